# SPDX-License-Identifier: Apache-2.0
# Run by cpack before it packs: what Debian wants otherwise than what is installed elsewhere. Each
# folder below CPACK_TEMPORARY_DIRECTORY is what a package will hold.
cmake_minimum_required(VERSION 3.22)
cmake_policy(SET CMP0011 NEW)
include(${CMAKE_CURRENT_LIST_DIR}/date.cmake)

function(run)
    execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

read_date(seconds)
# CPack dates what it packs with this.
set(ENV{SOURCE_DATE_EPOCH} ${seconds})
execute_process(COMMAND env LC_ALL=C TZ=UTC date -R -d @${seconds} OUTPUT_VARIABLE date
    OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)

function(write_documents share name)
    set(folder ${share}/doc/${name})
    file(MAKE_DIRECTORY ${folder})
    file(COPY_FILE ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/copyright ${folder}/copyright)
    set(version ${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
    file(WRITE ${folder}/changelog.Debian "peeler (${version}) unstable; urgency=medium\n\n"
        "  * Version ${CPACK_PACKAGE_VERSION}.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
    run(gzip -9nf ${folder}/changelog.Debian)
endfunction()

set(usr ${CPACK_TEMPORARY_DIRECTORY})
set(program ${usr}/command/usr)
set(packages command=peeler library=libpeeler0 development=libpeeler-dev python=python3-peeler)
foreach(package IN LISTS packages)
    string(REGEX MATCH "^(.*)=(.*)$" package ${package})
    if(IS_DIRECTORY ${usr}/${CMAKE_MATCH_1})
        write_documents(${usr}/${CMAKE_MATCH_1}/usr/share ${CMAKE_MATCH_2})
    endif()
endforeach()

file(GLOB pages ${program}/share/man/man1/*.1)
run(gzip -9nf ${pages})
# zsh and Python look for packages, and for what else is installed, in different folders.
if(IS_DIRECTORY ${program}/share/zsh/site-functions)
    file(RENAME ${program}/share/zsh/site-functions ${program}/share/zsh/vendor-completions)
endif()
file(GLOB python ${usr}/python/usr/lib/python3.*)
if(python)
    file(RENAME ${python} ${usr}/python/usr/lib/python3)
endif()
# The modules of the library are the program's, too.
file(REMOVE_RECURSE ${program}/${CPACK_PEELER_MODULES})
if(NOT CPACK_PEELER_LIBDIR STREQUAL "lib")
    get_filename_component(folder ${program}/${CPACK_PEELER_MODULES} DIRECTORY)
    file(MAKE_DIRECTORY ${folder})
    file(RELATIVE_PATH link ${folder} ${program}/${CPACK_PEELER_LIBDIR}/peeler)
    file(CREATE_LINK ${link} ${program}/${CPACK_PEELER_MODULES} SYMBOLIC)
else()
    # Nothing is left of lib.
    file(REMOVE_RECURSE ${program}/lib)
endif()
# Whoever builds may keep new files to himself (umask).
run(chmod -R u+rwX,go+rX,go-w ${usr})
