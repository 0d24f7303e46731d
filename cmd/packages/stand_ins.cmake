# SPDX-License-Identifier: Apache-2.0
# make_stand_ins(REGEX NOTHING FOLDER LIBRARIES...): writes stand-ins to FOLDER for the shared libraries
# that match REGEX and that LIBRARIES are linked with. A stand-in has the name of the original and the
# symbols that LIBRARIES need, so that they can be loaded. Functions whose mangled names match the
# regular expression NOTHING do nothing; a call of any other function ends the program. The originals
# must be in one of the folders `library_folders`.
function(symbols_of variable file option)
    # Sorted output would depend on the locale.
    execute_process(COMMAND ${nm} -D -S --no-sort --with-symbol-versions ${option} ${file}
        OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCHALL "[^\n]+" lines "${text}")
    set(${variable} "${lines}" PARENT_SCOPE)
endfunction()

function(make_stand_ins regex nothing folder)
    set(names)
    foreach(library IN LISTS ARGN)
        execute_process(COMMAND ${objdump} -p ${library} OUTPUT_VARIABLE headers
            COMMAND_ERROR_IS_FATAL ANY)
        string(REGEX MATCHALL "NEEDED +[^\n]+" needed "${headers}")
        list(TRANSFORM needed REPLACE "^NEEDED +" "")
        list(FILTER needed INCLUDE REGEX "${regex}")
        list(APPEND names ${needed})
        if(needed)
            symbols_of(lines ${library} --undefined-only)
            list(TRANSFORM lines REPLACE "^ *[Uwv] +([^@]+).*$" "\\1")
            foreach(symbol IN LISTS lines)
                set("wanted ${symbol}" TRUE)
            endforeach()
        endif()
    endforeach()
    list(REMOVE_DUPLICATES names)
    foreach(name IN LISTS names)
        find_file(original ${name} PATHS ${library_folders} NO_DEFAULT_PATH NO_CACHE REQUIRED)
        symbols_of(lines ${original} --defined-only)
        unset(original)
        string(CONCAT code "#include <cstdio>\n#include <cstdlib>\n[[noreturn]] static void absent() {\n"
            "    std::fputs(\"peeler: error: ${name} is not in this archive\\n\", stderr);\n"
            "    std::abort();\n}\nextern \"C\" {\n")
        set(versions)
        set(number 0)
        foreach(line IN LISTS lines)
            if(NOT line MATCHES "^[0-9a-f]+ (([0-9a-f]+) )?([A-Za-z]) ([^@]+)@*(.*)$")
                continue()
            endif()
            set(size "${CMAKE_MATCH_2}")
            set(kind ${CMAKE_MATCH_3})
            set(symbol ${CMAKE_MATCH_4})
            set(version "${CMAKE_MATCH_5}")
            if(NOT DEFINED "wanted ${symbol}")
                continue()
            endif()
            if(kind MATCHES "[TtWi]")
                set(body "absent();")
                if(symbol MATCHES "${nothing}")
                    set(body "")
                endif()
                string(APPEND code "void f${number}() asm(\"${symbol}\");\n"
                    "void f${number}() { ${body} }\n")
            else()
                string(APPEND code "extern char d${number}[] asm(\"${symbol}\");\n"
                    "alignas(16) char d${number}[0x${size}];\n")
            endif()
            if(NOT version STREQUAL "")
                list(APPEND versions ${version})
                string(APPEND of_${version} " ${symbol};")
            endif()
            math(EXPR number "${number} + 1")
        endforeach()
        set(script "")
        list(REMOVE_DUPLICATES versions)
        foreach(version IN LISTS versions)
            string(APPEND script "${version} { global:${of_${version}} };\n")
            unset(of_${version})
        endforeach()
        set(parts ${folder}/${name}.cpp ${folder}/${name}.map)
        file(WRITE ${folder}/${name}.cpp "${code}}\n")
        file(WRITE ${folder}/${name}.map "${script}")
        set(map)
        if(script)
            set(map -Wl,--version-script=${folder}/${name}.map)
        endif()
        # The file has nothing to debug, so it gets no build ID.
        execute_process(COMMAND ${compiler} -shared -fPIC -O1 -s -nostdlib -o ${folder}/${name}
            -Wl,--build-id=none -Wl,-soname,${name} ${map} ${folder}/${name}.cpp -lc
            COMMAND_ERROR_IS_FATAL ANY)
        file(REMOVE ${parts})
    endforeach()
endfunction()
