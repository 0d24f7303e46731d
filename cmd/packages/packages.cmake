# SPDX-License-Identifier: Apache-2.0
# Packages for users who do not build peeler: `cmake --build build/release --target packages` writes
# Debian packages, an archive, a wheel and (if there is rpmbuild) an RPM package to
# build/release/packages.
set(PEELER_MAINTAINER "the authors of peeler" CACHE STRING
    "Who answers for the Debian packages that are made here: NAME, or NAME <ADDRESS>")
set(PEELER_DOWNLOADS "" CACHE STRING "Address where these packages are published: their home page")

# The archive's bin/peeler, which chooses a C library and starts a program with it.
add_executable(peeler_launcher EXCLUDE_FROM_ALL ${PROJECT_SOURCE_DIR}/cmd/packages/launcher.cpp)
target_link_libraries(peeler_launcher PRIVATE peeler_options)
target_link_options(peeler_launcher PRIVATE -static)

set(packages ${PROJECT_BINARY_DIR}/packages)
set(packing ${PROJECT_BINARY_DIR}/packing)  # intermediate files
set(portable_name ${PROJECT_NAME}-${PROJECT_VERSION}-linux-${CMAKE_SYSTEM_PROCESSOR})
# Other projects' code that is compiled in. The archive contains their licences, too.
set(portable_sources ${PEELER_FONT} ${GLM_INCLUDE_DIR}/glm/glm.hpp ${XXHASH_INCLUDE_DIR}/xxhash.h
    ${TINYGLTF_INCLUDE_DIR}/tiny_gltf.h)
foreach(package nlohmann_json CLI11 draco)
    list(APPEND portable_sources ${${package}_DIR})
endforeach()
set(packed_python)
if(TARGET peeler_python)
    set(packed_python ${python_package})
endif()
find_program(PEELER_RPMBUILD rpmbuild)
mark_as_advanced(PEELER_RPMBUILD)
set(packed_rpm)
if(PEELER_RPMBUILD AND NOT CMAKE_CROSSCOMPILING)
    set(packed_rpm ON)
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/portable_settings.cmake.in
    ${packing}/portable_settings.cmake @ONLY)

add_custom_target(packages
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${packages}
    # The umask of the build must not affect the packages.
    COMMAND sh -c "umask 022 && exec \"$@\"" sh
        ${CMAKE_CPACK_COMMAND} -G DEB --config ${PROJECT_BINARY_DIR}/CPackConfig.cmake
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${packages}/_CPack_Packages
    COMMAND ${CMAKE_COMMAND} -D SETTINGS=${packing}/portable_settings.cmake
        -P ${CMAKE_CURRENT_LIST_DIR}/portable.cmake
    DEPENDS peeler peeler_launcher ${peeler_modules} ${peeler_helpers} write_manual
        peeler_shared peeler_static
    WORKING_DIRECTORY ${PROJECT_BINARY_DIR}
    COMMENT "Packing ${packages}" USES_TERMINAL VERBATIM)
if(TARGET peeler_python)
    add_dependencies(packages peeler_python)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME peeler)
set(CPACK_PACKAGE_VENDOR peeler)
set(CPACK_PACKAGE_CONTACT "${PEELER_MAINTAINER}")
set(CPACK_PACKAGE_DIRECTORY ${packages})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_COMPONENTS_ALL program manual documents library development)
if(TARGET peeler_python)
    list(APPEND CPACK_COMPONENTS_ALL python)
endif()
# There is one package for the program and its manual, and one for each other component.
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_COMPONENT_PROGRAM_GROUP command)
set(CPACK_COMPONENT_MANUAL_GROUP command)
# debian.cmake changes the Debian packages before cpack packs them.
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/debian.cmake)
set(CPACK_PEELER_LIBDIR ${CMAKE_INSTALL_LIBDIR})
set(CPACK_PEELER_MODULES ${peeler_module_folder})
list(TRANSFORM peeler_modules APPEND .so OUTPUT_VARIABLE CPACK_PEELER_OPTIONAL)
list(APPEND CPACK_PEELER_OPTIONAL peeler_3mf)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_HOMEPAGE "${PEELER_DOWNLOADS}")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(same_version "(= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
# This is CPack's default text. CPack would put any other text before the description of each
# package.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_NAME} built using CMake")
set(synopsis "every layer of a glTF scene, headless")
set(story "peeler renders all surfaces of a glTF scene under every pixel, hidden ones
included, into layered or deep OpenEXR files, exact composites, arrays and
points, on a GPU or in software, without a display.")
configure_file(${CMAKE_CURRENT_LIST_DIR}/rpm.cmake.in ${packing}/rpm.cmake @ONLY)

set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME peeler)
set(CPACK_COMPONENT_COMMAND_DESCRIPTION "${synopsis}\n${story}")
# GL is only recommended, because peeler rays and peeler bake work without GL.
set(CPACK_DEBIAN_COMMAND_PACKAGE_DEPENDS "libpeeler0 ${same_version}")
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS "libegl1, libgl1-mesa-dri")
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS "libosmesa6, peeler-doc")

set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_NAME peeler-doc)
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_SECTION doc)
set(CPACK_COMPONENT_DOCUMENTS_DESCRIPTION "${synopsis} (guide and examples)
${story}\n.\nThis package holds the guide, and scenes, readers and scheduler scripts.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libpeeler0)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS OFF)  # debian.cmake finds them
math(EXPR next_minor "${PROJECT_VERSION_MINOR} + 1")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "${synopsis} (library)
${story}\n.\nThis package holds the shared library, and what it loads when it is needed.")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_RECOMMENDS "libegl1, libgl1-mesa-dri")
# CPackDeb can generate shlibs for all packages or for none, and omits the ldconfig trigger.
file(WRITE ${packing}/shlibs "libpeeler ${PROJECT_VERSION_MAJOR} libpeeler0"
    " (>= ${PROJECT_VERSION}), libpeeler0 (<< ${PROJECT_VERSION_MAJOR}.${next_minor}~)\n")
file(WRITE ${packing}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA
    "${packing}/shlibs;${packing}/triggers")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libpeeler-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "${synopsis} (headers and static library)
${story}\n.\nThis package holds what programs that use the library are compiled with.")
# The packages from libopenexr-dev on are dependencies of peeler::static and of the pkg-config file.
string(CONCAT CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libpeeler0 ${same_version}, libglm-dev, "
    "libopenexr-dev, libdeflate-dev, libspng-dev, zlib1g-dev, libzstd-dev, libturbojpeg0-dev, "
    "libtinygltf-dev, libmeshoptimizer-dev")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-peeler)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "${synopsis} (Python module)
${story}\n.\nThis package holds the module peeler for Python 3, which runs the program:
layers as arrays of NumPy.")
# The module is pure Python; it runs the program.
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS OFF)
string(CONCAT CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "peeler ${same_version}, python3-numpy, "
    "python3 (>= 3.8~)")
# dpkg does not know the files that Python compiles, so prerm removes them.
file(WRITE ${packing}/postinst "#!/bin/sh\nset -e\n"
    "if command -v py3compile > /dev/null; then py3compile -p python3-peeler; fi\n")
file(WRITE ${packing}/prerm "#!/bin/sh\nset -e\n"
    "if command -v py3clean > /dev/null; then py3clean -p python3-peeler; fi\n")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${packing}/postinst;${packing}/prerm")
include(CPack)
