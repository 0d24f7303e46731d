# SPDX-License-Identifier: Apache-2.0
# read_date(VARIABLE): sets VARIABLE to the date of the packages, in seconds since 1970. The date is
# SOURCE_DATE_EPOCH, else the commit's date, else (outside a git clone) the current time, so that
# all builds of a commit have the same date.
function(read_date variable)
    set(seconds "$ENV{SOURCE_DATE_EPOCH}")
    if(seconds STREQUAL "")
        execute_process(COMMAND git log -1 --format=%ct OUTPUT_VARIABLE seconds ERROR_QUIET
            OUTPUT_STRIP_TRAILING_WHITESPACE WORKING_DIRECTORY ${CMAKE_CURRENT_FUNCTION_LIST_DIR})
    endif()
    if(seconds STREQUAL "")
        string(TIMESTAMP seconds "%s" UTC)
    endif()
    set(${variable} "${seconds}" PARENT_SCOPE)
endfunction()
