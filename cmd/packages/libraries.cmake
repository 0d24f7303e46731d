# SPDX-License-Identifier: Apache-2.0
# The shared libraries in an archive for machines where nothing can be installed. Runs on Debian,
# because the libraries come from its packages. Needs objdump and the variables that stand_ins.cmake
# needs.
include(${CMAKE_CURRENT_LIST_DIR}/stand_ins.cmake)

# Libraries of the target machine: the C library, and GL with everything that belongs to a driver.
set(c_library "^(ld-linux|lib(c|m|dl|rt|pthread|resolv|util|mvec)\\.so)")
set(machines ${c_library} "^lib(GL|EGL|OSMesa|gbm|drm|glapi|X|xcb|wayland|va|vdpau|OpenCL)")
# Libraries that drivers use, too. The target machine's own copies take precedence.
set(spare "^lib(stdc\\+\\+|gcc_s|gomp|z|zstd|lzma|bz2|expat)\\.so")

# copy_libraries(LIBRARIES KEPT FOLDER LEFT_OUT EXECUTABLES ... MODULES ...): copies the shared
# libraries that the executables and modules need to FOLDER; those that match `spare` go to
# FOLDER/spare. Skips libraries that match a regular expression in LEFT_OUT, and libraries that only
# skipped libraries need. Sets LIBRARIES to the paths of the originals and KEPT to the paths of the
# copies.
function(copy_libraries libraries kept folder left_out)
    file(GET_RUNTIME_DEPENDENCIES ${ARGN} PRE_EXCLUDE_REGEXES ${left_out}
        RESOLVED_DEPENDENCIES_VAR found)
    file(MAKE_DIRECTORY ${folder}/spare)
    set(copied)
    foreach(library IN LISTS found)
        get_filename_component(file_name ${library} NAME)
        set(target ${folder}/${file_name})
        if(file_name MATCHES "${spare}")
            set(target ${folder}/spare/${file_name})
        endif()
        file(REAL_PATH ${library} real)
        file(COPY_FILE ${real} ${target})
        list(APPEND copied ${target})
    endforeach()
    set(${libraries} ${found} PARENT_SCOPE)
    set(${kept} ${copied} PARENT_SCOPE)
endfunction()
