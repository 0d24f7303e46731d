# SPDX-License-Identifier: Apache-2.0
# Changes for Debian packages. cpack runs this file before it packs. Each folder below
# CPACK_TEMPORARY_DIRECTORY holds the files of one package.
cmake_minimum_required(VERSION 3.22)
cmake_policy(SET CMP0011 NEW)
include(${CMAKE_CURRENT_LIST_DIR}/date.cmake)

function(run)
    execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

read_date(seconds)
# CPack uses this as the date of the packed files.
set(ENV{SOURCE_DATE_EPOCH} ${seconds})
# dpkg-shlibdeps reads this variable in a cross build.
set(ENV{DEB_HOST_ARCH} ${CPACK_DEBIAN_PACKAGE_ARCHITECTURE})
execute_process(COMMAND env LC_ALL=C TZ=UTC date -R -d @${seconds} OUTPUT_VARIABLE date
    OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)

function(write_documents share name)
    set(folder ${share}/doc/${name})
    file(MAKE_DIRECTORY ${folder})
    file(COPY_FILE ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/copyright ${folder}/copyright)
    set(who ${CPACK_PACKAGE_CONTACT})
    if(NOT who MATCHES ">$")
        string(APPEND who " <>")  # parsers of changelogs need an address
    endif()
    set(version ${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
    file(WRITE ${folder}/changelog.Debian "peeler (${version}) unstable; urgency=medium\n\n"
        "  * Version ${CPACK_PACKAGE_VERSION}.\n\n -- ${who}  ${date}\n")
    run(gzip -9nf ${folder}/changelog.Debian)
endfunction()

set(usr ${CPACK_TEMPORARY_DIRECTORY})
set(program ${usr}/command/usr)
set(packages command=peeler documents=peeler-doc library=libpeeler0 development=libpeeler-dev
    python=python3-peeler)
foreach(package IN LISTS packages)
    string(REGEX MATCH "^(.*)=(.*)$" package ${package})
    if(IS_DIRECTORY ${usr}/${CMAKE_MATCH_1})
        write_documents(${usr}/${CMAKE_MATCH_1}/usr/share ${CMAKE_MATCH_2})
    endif()
endforeach()

file(GLOB pages ${program}/share/man/man1/*.1)
run(gzip -9nf ${pages})
# zsh and Python have separate folders for files from Debian packages and for local files.
if(IS_DIRECTORY ${program}/share/zsh/site-functions)
    file(RENAME ${program}/share/zsh/site-functions ${program}/share/zsh/vendor-completions)
endif()
file(GLOB python ${usr}/python/usr/lib/python3.*)
if(python)
    file(RENAME ${python} ${usr}/python/usr/lib/python3)
endif()
# The program uses the modules of the library's package.
file(REMOVE_RECURSE ${program}/${CPACK_PEELER_MODULES})
if(NOT CPACK_PEELER_LIBDIR STREQUAL "lib")
    get_filename_component(folder ${program}/${CPACK_PEELER_MODULES} DIRECTORY)
    file(MAKE_DIRECTORY ${folder})
    file(RELATIVE_PATH link ${folder} ${program}/${CPACK_PEELER_LIBDIR}/peeler)
    file(CREATE_LINK ${link} ${program}/${CPACK_PEELER_MODULES} SYMBOLIC)
else()
    # The folder lib had only the modules.
    file(REMOVE_RECURSE ${program}/lib)
endif()
# What is loaded only when it is needed recommends its libraries, and the rest requires them. CPack
# can only require the libraries of all files.
set(loaded)
foreach(name IN LISTS CPACK_PEELER_OPTIONAL)
    list(APPEND loaded -e ${CPACK_PEELER_LIBDIR}/peeler/${name})
endforeach()
file(MAKE_DIRECTORY ${usr}/library/usr/debian)  # dpkg-shlibdeps reads a file of this folder
file(WRITE ${usr}/library/usr/debian/control "Source: peeler\n\nPackage: libpeeler0\nArchitecture: any\n")
execute_process(COMMAND dpkg-shlibdeps --ignore-missing-info -O
    -e ${CPACK_PEELER_LIBDIR}/libpeeler.so.${CPACK_PACKAGE_VERSION}
    -e ${CPACK_PEELER_LIBDIR}/peeler/peeler_decode -dRecommends ${loaded}
    WORKING_DIRECTORY ${usr}/library/usr OUTPUT_VARIABLE found ERROR_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE_RECURSE ${usr}/library/usr/debian)
foreach(field Depends Recommends)
    string(TOUPPER CPACK_DEBIAN_LIBRARY_PACKAGE_${field} variable)
    string(REGEX MATCH "shlibs:${field}=([^\n]*)" libraries ${found})
    list(APPEND ${variable} ${CMAKE_MATCH_1})
    list(JOIN ${variable} ", " ${variable})
endforeach()
# The umask of the build must not affect the packages.
run(chmod -R u+rwX,go+rX,go-w ${usr})
