# SPDX-License-Identifier: Apache-2.0
# collect_licences(FOLDER FILES...): writes three things to FOLDER: libraries.txt, the names and
# versions of the Debian packages that contain FILES; licences/PACKAGE for each package; and the
# common licences to which licences/PACKAGE refers.
function(package_of variable file)
    file(REAL_PATH ${file} real)
    string(REGEX REPLACE "^/usr" "" short ${real})
    # /lib is a link to /usr/lib, and packages use either name.
    foreach(name ${real} ${short} ${file})
        execute_process(COMMAND dpkg-query -S ${name} OUTPUT_VARIABLE found ERROR_QUIET
            RESULT_VARIABLE failed)
        if(NOT failed)
            string(REGEX REPLACE "^([^:,]+).*" "\\1" found "${found}")
            set(${variable} ${found} PARENT_SCOPE)
            return()
        endif()
    endforeach()
    message(FATAL_ERROR "${file} is of no Debian package")
endfunction()

function(collect_licences folder)
    set(rows)
    set(packages libc6)  # peeler_decode contains its static library.
    foreach(file IN LISTS ARGN)
        package_of(package ${file})
        list(APPEND packages ${package})
    endforeach()
    list(REMOVE_DUPLICATES packages)
    list(SORT packages)
    set(common)
    foreach(package IN LISTS packages)
        execute_process(COMMAND dpkg-query -W -f "\${source:Package} \${source:Version}\n" ${package}
            OUTPUT_VARIABLE version COMMAND_ERROR_IS_FATAL ANY)
        # With Multi-Arch, a package may be installed for several architectures.
        string(REGEX REPLACE "\n.*" "" version "${version}")
        list(APPEND rows "${package}, of Debian's source ${version}\n")
        set(licence /usr/share/doc/${package}/copyright)
        configure_file(${licence} ${folder}/licences/${package} COPYONLY)
        file(READ ${licence} text)
        string(REGEX MATCHALL "common-licenses/[A-Za-z0-9.+-]*[A-Za-z0-9]" found "${text}")
        list(APPEND common ${found})
    endforeach()
    list(REMOVE_DUPLICATES common)
    foreach(licence IN LISTS common)
        if(EXISTS /usr/share/${licence})
            file(REAL_PATH /usr/share/${licence} real)
            configure_file(${real} ${folder}/${licence} COPYONLY)
        endif()
    endforeach()
    list(JOIN rows "" rows)
    file(WRITE ${folder}/libraries.txt "${rows}")
endfunction()
