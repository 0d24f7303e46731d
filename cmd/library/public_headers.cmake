# SPDX-License-Identifier: Apache-2.0
# peeler_public_headers(FOLDER): generates the headers that users of the library include, each from
# headers of ours that are about one thing, and nothing else of ours: includes of what is not public
# are an error. FOLDER gets peeler/scene.h and so on.
set(peeler_public
    "error:core/base/error.h"
    "scene:core/scene/material.h,core/scene/scene.h"
    "view:core/base/window.h,core/scene/view.h,core/scene/camera_choice.h"
    "layered_image:core/image/layered_image.h,core/image/channels.h,core/image/composite.h,core/base/stage_times.h,core/image/sink.h,core/image/image_sink.h"
    "rays:core/rays/bundle.h"
    "renderer:core/base/work.h,core/base/memory_budget.h,core/scene/clip.h,core/capture/capture_settings.h,cmd/library/renderer.h"
    "files:core/image/merge.h,formats/file/output_options.h,formats/gltf/gltf_reader.h,formats/meshes/scene_read_options.h,formats/exr/layered_read_options.h,cmd/library/files.h")

function(peeler_public_headers folder)
    foreach(row IN LISTS peeler_public)
        string(REGEX MATCH "^([a-z_]+):(.*)$" row ${row})
        string(REPLACE "," ";" sources ${CMAKE_MATCH_2})
        foreach(source IN LISTS sources)
            set(public_of_${source} ${CMAKE_MATCH_1})
        endforeach()
    endforeach()
    foreach(row IN LISTS peeler_public)
        string(REGEX MATCH "^([a-z_]+):(.*)$" row ${row})
        set(name ${CMAKE_MATCH_1})
        string(REPLACE "," ";" sources ${CMAKE_MATCH_2})
        set(system "")
        set(own "")
        set(text "")
        foreach(source IN LISTS sources)
            set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
                ${PROJECT_SOURCE_DIR}/${source})
            file(READ ${PROJECT_SOURCE_DIR}/${source} body)
            # Lists of CMake end at semicolons and brackets.
            string(REGEX MATCHALL "#include [<\"][a-z0-9_./]+[>\"]" includes "${body}")
            foreach(include IN LISTS includes)
                if(include MATCHES "\"(.*)\"")
                    set(included "${public_of_${CMAKE_MATCH_1}}")
                    if(included STREQUAL "")
                        message(FATAL_ERROR "${source} is public and includes ${CMAKE_MATCH_1}")
                    elseif(NOT included STREQUAL name)
                        list(APPEND own "#include <peeler/${included}.h>\n")
                    endif()
                else()
                    list(APPEND system "${include}\n")
                endif()
            endforeach()
            string(REGEX REPLACE "^// SPDX[^\n]*\n" "\n" body "${body}")
            string(REGEX REPLACE "#pragma once\n" "" body "${body}")
            string(REGEX REPLACE "#include [^\n]*\n" "" body "${body}")
            string(REGEX REPLACE "\n\n\n+" "\n\n" body "${body}")
            string(APPEND text "${body}")
        endforeach()
        foreach(list system own)
            list(REMOVE_DUPLICATES ${list})
            list(SORT ${list})
            list(JOIN ${list} "" ${list})
        endforeach()
        set(header "// SPDX-License-Identifier: Apache-2.0\n#pragma once\n\n${system}\n${own}${text}")
        file(CONFIGURE OUTPUT ${folder}/peeler/${name}.h CONTENT "${header}" @ONLY)
    endforeach()
endfunction()
