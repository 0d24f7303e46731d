# SPDX-License-Identifier: Apache-2.0
# cmake -D SETTINGS=FILE -D ROOT=FOLDER -P programs.cmake: copies the programs for a run on a GPU, the libraries that
# the machine may lack, and Mesa's rasteriser.
cmake_minimum_required(VERSION 3.22)
include(${SETTINGS})
include(${CMAKE_CURRENT_LIST_DIR}/../../cmd/packages/libraries.cmake)

# Large libraries that the run does not need. Only tests that the run skips use Embree. LLVM links the other libraries,
# but uses them only for features that Mesa does not need.
set(unused "^lib(embree|z3|xml2|edit)")
set(library_folders /usr/lib/${architecture} /lib/${architecture} /usr/lib /lib)

foreach(file peeler tests/gl_tests tests/gpu_choices ${modules_folder}/peeler_decode tests/fake_egl/libEGL.so.1)
    if(NOT EXISTS ${build}/${file})
        message(FATAL_ERROR "${build} has no ${file}: build it first")
    endif()
endforeach()
file(MAKE_DIRECTORY ${ROOT}/bin ${ROOT}/${modules_folder} ${ROOT}/lib/fake_egl ${ROOT}/lib/osmesa)
foreach(pair peeler=bin/peeler tests/gl_tests=bin/gl_tests tests/gpu_choices=bin/gpu_choices
        ${modules_folder}/peeler_decode=${modules_folder}/peeler_decode
        tests/fake_egl/libEGL.so.1=lib/fake_egl/libEGL.so.1)
    string(REGEX MATCH "^(.*)=(.*)$" pair ${pair})
    execute_process(COMMAND ${strip} -o ${ROOT}/${CMAKE_MATCH_2} ${build}/${CMAKE_MATCH_1}
        COMMAND_ERROR_IS_FATAL ANY)
endforeach()

copy_libraries(libraries kept ${ROOT}/lib "${machines};${unused}"
    EXECUTABLES ${ROOT}/bin/peeler ${ROOT}/bin/gl_tests ${ROOT}/bin/gpu_choices)
make_stand_ins("${unused}" "^$" ${ROOT}/lib ${kept} ${ROOT}/bin/gl_tests)

# The rasteriser's own folder, so that no driver finds its LLVM.
find_file(osmesa libOSMesa.so.8 PATHS ${library_folders} NO_DEFAULT_PATH)
if(NOT osmesa)
    message(STATUS "There is no libOSMesa.so.8 to be packed")
    return()
endif()
file(REAL_PATH ${osmesa} real)
file(COPY_FILE ${real} ${ROOT}/lib/osmesa/libOSMesa.so.8)
copy_libraries(libraries kept ${ROOT}/lib/osmesa "${c_library};${unused}" MODULES ${osmesa})
make_stand_ins("${unused}" "^$" ${ROOT}/lib/osmesa ${kept})
