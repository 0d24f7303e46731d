# SPDX-License-Identifier: Apache-2.0
# With preset fuzz, each fuzz target is a libFuzzer program (target `fuzzers`); otherwise all targets are in one program
# of regression tests. See tests/README.md, "Fuzzing".
file(GLOB fuzz_targets CONFIGURE_DEPENDS fuzz/*_fuzz.cpp)
file(GLOB fuzz_seeds CONFIGURE_DEPENDS fuzz/*_seeds.cpp)
# draco_decoder.cpp has the main function of peeler_decode, which is an ordinary function here.
set(draco_in_process ${PROJECT_SOURCE_DIR}/formats/modules/draco_decoder.cpp)
set_source_files_properties(${draco_in_process} PROPERTIES
    COMPILE_DEFINITIONS main=dracoDecoderMain SKIP_UNITY_BUILD_INCLUSION ON)
# libdraco.so exports its own tinygltf with another layout, so the linker must see TINYGLTF_LIBRARY first (as in
# unit_tests). The archive with the symbols needed here comes later.
set(fuzz_libraries -Wl,--push-state,--no-as-needed,${TINYGLTF_LIBRARY},--pop-state draco::draco
    OpenEXR::OpenEXR meshoptimizer::meshoptimizer ${DEFLATE_LIBRARY} ${ZSTD_LIBRARY})

peeler_test_program(fuzz_tests SOURCES fuzz/fuzz_test.cpp fuzz/fuzz_target.cpp ${fuzz_targets}
    ${fuzz_seeds} ${draco_in_process} LIBRARIES ${fuzz_libraries})
peeler_test_shards(fuzz fuzz_tests SHARDS 2 LABELS fuzz)

if(NOT PEELER_SANITIZE MATCHES "fuzzer")
    return()
endif()

# -O1 compiles faster; the fuzzers run little of the command line's code.
target_compile_options(peeler_cmd PRIVATE -O1 -gline-tables-only)

function(peeler_fuzz_program name)
    add_executable(${name} EXCLUDE_FROM_ALL fuzz/fuzz_target.cpp ${ARGN})
    target_link_libraries(${name} PRIVATE peeler_formats nlohmann_json::nlohmann_json
        ${fuzz_libraries})
    target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
    target_link_options(${name} PRIVATE -Wl,--as-needed)
    # Instrumented modules call the program's coverage functions, so export them.
    set_target_properties(${name} PROPERTIES UNITY_BUILD OFF ENABLE_EXPORTS ON)
endfunction()

set(gltf_more fuzz/gltf_mutator.cpp)
set(image_more fuzz/checksum_mutator.cpp)
set(points_more fuzz/checksum_mutator.cpp)
set(draco_more ${draco_in_process})
set(of_commands batch exr grammar worker)

peeler_fuzz_program(write_seeds fuzz/seed_writer.cpp ${fuzz_seeds})
target_link_libraries(write_seeds PRIVATE GTest::gtest)
add_custom_target(fuzzers DEPENDS write_seeds)
foreach(source IN LISTS fuzz_targets)
    get_filename_component(program ${source} NAME_WE)
    string(REPLACE "_fuzz" "" name ${program})
    peeler_fuzz_program(${program} ${source} ${${name}_more})
    target_compile_definitions(${program} PRIVATE PEELER_LIBFUZZER)
    target_link_options(${program} PRIVATE -fsanitize=fuzzer)
    if(name IN_LIST of_commands)
        target_link_libraries(${program} PRIVATE peeler_cmd)
    endif()
    add_dependencies(fuzzers ${program})
endforeach()
