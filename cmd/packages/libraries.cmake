# SPDX-License-Identifier: Apache-2.0
# What an archive carries for programs of a build, for machines where nothing may be installed. On
# Debian, whose packages it takes it from. Needs objdump, and what stand_ins.cmake needs.
include(${CMAKE_CURRENT_LIST_DIR}/stand_ins.cmake)

# Of the machine: the C library, and GL with all that belongs to a driver.
set(c_library "^(ld-linux|lib(c|m|dl|rt|pthread|resolv|util|mvec)\\.so)")
set(machines ${c_library} "^lib(GL|EGL|OSMesa|gbm|drm|glapi|X|xcb|wayland|va|vdpau|OpenCL)")
# What drivers are linked with as well: the machine's come first.
set(spare "^lib(stdc\\+\\+|gcc_s|gomp|z|zstd|lzma|bz2|expat)\\.so")

# copy_libraries(LIBRARIES KEPT FOLDER LEFT_OUT EXECUTABLES ... MODULES ...): copies the shared
# libraries that these files need into FOLDER, those called as `spare` says into FOLDER/spare. Those
# called as one of the regular expressions LEFT_OUT says stay away, with what only they need.
# LIBRARIES are where they were, KEPT where they are.
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
