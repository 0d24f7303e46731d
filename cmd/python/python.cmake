# SPDX-License-Identifier: Apache-2.0
# The Python package `peeler`, in python/ of the build folder: a client of `peeler worker` in pure Python.
# The keywords of its functions come from the options that the verbs declare.
set(peeler_has_python OFF)
if(PEELER_PYTHON AND NOT PEELER_SANITIZE)
    # Prefers Debian's Python to others in the path, unless Python3_EXECUTABLE is set.
    if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
        set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python that writes the package")
    endif()
    if(PEELER_PYTHON STREQUAL "AUTO")
        find_package(Python3 3.8 COMPONENTS Interpreter QUIET)
    else()
        find_package(Python3 3.8 COMPONENTS Interpreter REQUIRED)
    endif()
    set(peeler_has_python ${Python3_FOUND})
endif()
if(NOT peeler_has_python)
    message(STATUS "No Python package (PEELER_PYTHON=${PEELER_PYTHON}): without Python 3.8, or not wanted")
    return()
endif()

file(GLOB python_files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/cmd/python/peeler/*.py
    ${CMAKE_CURRENT_SOURCE_DIR}/cmd/python/peeler/py.typed)
set(python_source ${CMAKE_CURRENT_SOURCE_DIR}/cmd/python)
set(python_package ${PROJECT_BINARY_DIR}/python/peeler)
add_custom_command(OUTPUT ${python_package}/__init__.pyi
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${python_package}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${python_package}
    COMMAND ${CMAKE_COMMAND} -E copy ${python_files} ${manual}/peeler/verbs.json ${python_package}
    COMMAND ${Python3_EXECUTABLE} -B ${python_source}/write_stub.py ${python_package}
    DEPENDS ${python_files} ${python_source}/write_stub.py ${python_source}/stub.pyi write_manual
    COMMENT "Writing ${python_package}" VERBATIM)
add_custom_target(peeler_python ALL DEPENDS ${python_package}/__init__.pyi)

# Debian's Python has separate folders for packages and for local files.
set(python_folder lib/python3/dist-packages)
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr/local")
    set(python_folder lib/python${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}/dist-packages)
endif()
set(PEELER_PYTHON_FOLDER ${python_folder} CACHE STRING "Folder of the prefix for the Python package")
install(DIRECTORY ${python_package} DESTINATION ${PEELER_PYTHON_FOLDER} COMPONENT python
    PATTERN __pycache__ EXCLUDE)
