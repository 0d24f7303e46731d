# SPDX-License-Identifier: Apache-2.0
# The shared libraries in an archive for machines where nothing can be installed. Runs on Debian,
# because the libraries come from its packages. Needs objdump and the variables that stand_ins.cmake
# needs.
include(${CMAKE_CURRENT_LIST_DIR}/stand_ins.cmake)

# The C library, in the archive and on the target machine. The archive's launcher takes the newer one.
set(c_library "(ld-linux|lib(c|m|dl|rt|pthread|resolv|util|mvec|anl)\\.so)")
# Libraries of the target machine only: GL, with everything that belongs to a driver.
set(machines "^${c_library}" "^lib(GL|EGL|OSMesa|gbm|drm|glapi|X|xcb|wayland|va|vdpau|OpenCL)")
# Libraries that GL drivers use, too: the launcher takes the newer one.
set(shared "^lib(stdc\\+\\+|gcc_s|gomp|z|zstd|lzma|bz2|expat)\\.so")

# copy_libraries(LIBRARIES KEPT FOLDER LEFT_OUT EXECUTABLES ... MODULES ...): copies the shared
# libraries that the executables and modules need to FOLDER; those that match `shared` go to
# FOLDER/shared/NAME. Skips libraries that match a regular expression in LEFT_OUT, and libraries that
# only skipped libraries need. Sets LIBRARIES to the paths of the originals and KEPT to the paths of
# the copies.
function(copy_libraries libraries kept folder left_out)
    file(GET_RUNTIME_DEPENDENCIES ${ARGN} PRE_EXCLUDE_REGEXES ${left_out}
        RESOLVED_DEPENDENCIES_VAR found)
    set(copied)
    foreach(library IN LISTS found)
        get_filename_component(file_name ${library} NAME)
        set(target ${folder}/${file_name})
        if(file_name MATCHES "${shared}")
            set(target ${folder}/shared/${file_name}/${file_name})
        endif()
        file(REAL_PATH ${library} real)
        get_filename_component(target_folder ${target} DIRECTORY)
        file(MAKE_DIRECTORY ${target_folder})
        file(COPY_FILE ${real} ${target})
        list(APPEND copied ${target})
    endforeach()
    set(${libraries} ${found} PARENT_SCOPE)
    set(${kept} ${copied} PARENT_SCOPE)
endfunction()

# Copies all of the C library from the folder FROM to the folder TO. Its parts use private symbols of
# each other, so a program must not mix two versions.
function(copy_c_library to from)
    file(GLOB files ${from}/ld-linux*.so.? ${from}/lib*.so.?)
    list(FILTER files INCLUDE REGEX "/${c_library}")
    file(MAKE_DIRECTORY ${to})
    foreach(file IN LISTS files)
        get_filename_component(file_name ${file} NAME)
        file(REAL_PATH ${file} real)
        file(COPY_FILE ${real} ${to}/${file_name})
    endforeach()
endfunction()
