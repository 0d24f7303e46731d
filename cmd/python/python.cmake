# SPDX-License-Identifier: Apache-2.0
# The Python package `peeler`, in python/ of the build's folder. It holds all that it needs: the
# module is linked with the objects of the library and of the verbs, and what the program loads when
# it needs it lies beside it.
set(peeler_has_python OFF)
if(PEELER_PYTHON AND NOT PEELER_SANITIZE)
    # Debian's Python, whatever other one is first in the path; PYTHON_EXECUTABLE says otherwise.
    if(NOT PYTHON_EXECUTABLE AND EXISTS /usr/bin/python3)
        set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python that the module is for")
    endif()
    if(PEELER_PYTHON STREQUAL "AUTO")
        find_package(pybind11 2.9 QUIET)
    else()
        find_package(pybind11 2.9 REQUIRED)
    endif()
    set(peeler_has_python ${pybind11_FOUND})
endif()
if(NOT peeler_has_python)
    message(STATUS "No Python module (PEELER_PYTHON=${PEELER_PYTHON}): without pybind11-dev and python3-dev, or not wanted")
    return()
endif()

file(GLOB python_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/cmd/python/*.cpp)
file(GLOB python_files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/cmd/python/peeler/*)
set(python_package ${PROJECT_BINARY_DIR}/python/peeler)
# pybind11's own way of optimising at link time takes minutes for nothing.
pybind11_add_module(peeler_python NO_EXTRAS ${python_sources})
target_link_libraries(peeler_python PRIVATE peeler_library peeler_cmd)
target_compile_definitions(peeler_python PRIVATE PEELER_VERSION="${PROJECT_VERSION}")
# It hands over what others have found: pybind11's templates take long to optimise for nothing.
target_compile_options(peeler_python PRIVATE -O1 -fvisibility=hidden)
# Nothing of it is seen by other modules of the same process, which may be linked with libpeeler.
target_link_options(peeler_python PRIVATE -Wl,--exclude-libs,ALL)
set_target_properties(peeler_python PROPERTIES OUTPUT_NAME _peeler
    LIBRARY_OUTPUT_DIRECTORY ${python_package} LINK_DEPENDS "${python_files}")
if(PEELER_COVERAGE)
    target_link_options(peeler_python PRIVATE --coverage)
endif()
add_custom_command(TARGET peeler_python POST_BUILD
    COMMAND ${CMAKE_COMMAND} -E copy_if_different ${python_files} ${python_package}
    COMMAND ${CMAKE_COMMAND} -E create_symlink ${PROJECT_BINARY_DIR}/lib ${python_package}/lib
    VERBATIM)

# Where Debian's Python looks for what is not a part of its packages, and for what is.
set(python_folder lib/python3/dist-packages)
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr/local")
    set(python_folder lib/python${PYTHON_VERSION_MAJOR}.${PYTHON_VERSION_MINOR}/dist-packages)
endif()
set(PEELER_PYTHON_FOLDER ${python_folder} CACHE STRING "Folder of the prefix for the Python package")
install(TARGETS peeler_python LIBRARY DESTINATION ${PEELER_PYTHON_FOLDER}/peeler COMPONENT python)
install(FILES ${python_files} DESTINATION ${PEELER_PYTHON_FOLDER}/peeler COMPONENT python)
install(TARGETS ${peeler_modules} LIBRARY
    DESTINATION ${PEELER_PYTHON_FOLDER}/peeler/${peeler_module_folder} COMPONENT python)
install(TARGETS peeler_decode RUNTIME
    DESTINATION ${PEELER_PYTHON_FOLDER}/peeler/${peeler_module_folder} COMPONENT python)
