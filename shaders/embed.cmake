# SPDX-License-Identifier: Apache-2.0
# peeler_embed_shaders(OUT FOLDER): generates a C++ file and sets OUT to its path. The C++ file holds
# every *.glsl, *.vert, *.frag and *.comp of FOLDER as a string, under the shader's file name.
function(peeler_embed_shaders out folder)
    file(GLOB shaders CONFIGURE_DEPENDS ${folder}/*.glsl ${folder}/*.vert ${folder}/*.frag ${folder}/*.comp)
    set(generated ${CMAKE_CURRENT_BINARY_DIR}/shader_sources.cpp)
    set(text "// Generated from shaders/ by embed.cmake.\n#include \"core/gl/program.h\"\n")
    string(APPEND text "namespace peeler::gl {\nnamespace {\nconst ShaderSource kSources[] = {\n")
    foreach(shader IN LISTS shaders)
        get_filename_component(name ${shader} NAME)
        file(READ ${shader} source)
        string(APPEND text "{\"${name}\", R\"__glsl(${source})__glsl\"},\n")
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${shader})
    endforeach()
    string(APPEND text "};\n}\nstd::span<const ShaderSource> embeddedShaders() { return kSources; }\n}\n")
    file(CONFIGURE OUTPUT ${generated} CONTENT "${text}" @ONLY)
    set(${out} ${generated} PARENT_SCOPE)
endfunction()

# peeler_embed_text(OUT FILE HEADER FUNCTION): generates a C++ file and sets OUT to its path. The C++
# file defines the function FUNCTION, declared in HEADER, which returns the text of FILE.
function(peeler_embed_text out path header function)
    get_filename_component(name ${path} NAME_WE)
    set(generated ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
    file(READ ${path} source)
    set(text "// Generated from ${name} by embed.cmake.\n#include \"${header}\"\n")
    string(APPEND text "std::string_view peeler::${function}() { return R\"__text(${source})__text\"; }\n")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path})
    file(CONFIGURE OUTPUT ${generated} CONTENT "${text}" @ONLY)
    set(${out} ${generated} PARENT_SCOPE)
endfunction()
