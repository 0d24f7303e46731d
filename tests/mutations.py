# SPDX-License-Identifier: Apache-2.0
"""Breaks the product on purpose, one place after the other: the short run of the tests has to see each.

    sh tests/run.sh mutations [NAME ...]

Works on a copy of the tree in build/mutations, so nothing here is touched. Of the short run it takes the
programs that are said to see the mutation (a label of ctest) and stops at the first test that fails. Exits
with 1 if a mutation is not seen, or if its text is not in the code any more."""

import os
import pathlib
import subprocess
import sys
import time

SOURCE = pathlib.Path(__file__).resolve().parents[1]
COPY = SOURCE / "build" / "mutations"

# (name, file, text that stands there once, what it becomes, label of the tests that see it)
MUTATIONS = (
    ("winding", "core/capture/scene_rasterizer.cpp", "draw.mirrored ? GL_CW : GL_CCW",
     "draw.mirrored ? GL_CCW : GL_CW", "gl"),
    ("half-space sign", "core/capture/scene_rasterizer.cpp", "plane.z, -plane.w);", "plane.z, plane.w);",
     "gl"),
    ("sort direction", "core/capture/depth_sort.cpp", "{~fragment[0]} << 32", "{fragment[0]} << 32", "unit"),
    ("order of coincident fragments", "core/capture/depth_sort.cpp", "<< 32 | fragment[1]",
     "<< 32 | (0xFFFFFFFFU - fragment[1])", "unit"),
    ("ping-pong order", "core/peel/layer_targets.cpp",
     ".depth_test = direction.depth_test},\n                        area);\n        take(layer, current);",
     ".depth_test = direction.depth_test},\n                        area);\n        take(layer, previous);",
     "gl"),
    ("back-to-front index", "shaders/blend_layer.frag", "counts[pixel] - 1u - uint(layer.x)",
     "counts[pixel] - uint(layer.x)", "gl"),
    ("tail bound", "shaders/resolve.comp", "slots[pixel] += uint(n);", "", "gl"),
    ("average formula on the GPU", "shaders/resolve.comp", "1.0 - sum.a / n), n)",
     "1.0 - sum.a), n)", "gl"),
    ("average formula on layers", "core/image/composite.cpp", "1.0F - sum / n), n)",
     "1.0F - sum), n)", "gl"),
    ("over", "core/image/composite.cpp", "c < 4; ++c)\n        sum[c] += rest * b[c];",
     "c < 4; ++c)\n        sum[c] += b[c];", "unit"),
    ("coloured opacity", "core/image/composite.cpp", "rest = 1.0F - a[4 + c];", "rest = 1.0F - a[3];",
     "unit"),
    ("merge rule", "core/image/deep_merge.cpp",
     "case DeepMerge::kByZ:\n                return distance <= settings_.z_tolerance;",
     "case DeepMerge::kByZ:\n                return distance < settings_.z_tolerance;", "unit"),
    ("transmittance", "shaders/transmission.glsl", "(tint.r + tint.g + tint.b) / 3.0", "tint.g", "gl"),
    ("colours of glass", "shaders/transmission.glsl", "(1.0 - metalness(g)) * clamp(base, 0.0, 1.0), 0.0",
     "(1.0 - metalness(g)) * vec3(base.g), 0.0", "gl"),
    ("shadow test", "shaders/shadows.glsl", "return depth > texelFetch", "return depth < texelFetch",
     "gl"),
    ("cone of a spot", "shaders/lights.glsl", "window * cone * cone / squared",
     "window * cone / squared", "gl"),
    ("keys of instances", "shaders/scene.vert", "draw.ids.x + instance * draw.ids.y", "draw.ids.x",
     "gl"),
    ("spans of solids", "core/rays/solids.cpp", "k + 1 < end; k += 2", "k + 1 < end; ++k", "unit"),
    ("windows of layers", "core/image/layers.cpp", "for (std::size_t k = windows_.size(); k-- > 0;)",
     "for (std::size_t k = windows_.size(); k-- > 1;)", "unit"),
    ("crop offset", "formats/exr/exr_header.cpp", "crop[0] + crop[2]", "crop[0] + crop[3]", "unit"),
    ("lists of arrays", "formats/arrays/picture_array_reader.cpp", "if (end != arrays_->z->shape.front())",
     "if (false)", "unit"),
    ("alignment of arrays", "formats/arrays/safetensors_container.cpp", "order, std::greater()",
     "order, std::less()", "unit"),
    ("faces of arrays", "formats/meshes/array_scene.cpp",
     "index < static_cast<double>(primitive_.positions.size())",
     "index <= static_cast<double>(primitive_.positions.size())", "unit"),
    ("sandbox check", "formats/gltf/gltf_files.cpp",
     'if (std::find(relative.begin(), relative.end(), "..") != relative.end())', "if (false)", "unit"),
    ("Draco's mapping of points", "formats/modules/draco_decoder.cpp",
     "attribute.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));",
     "draco::AttributeValueIndex(static_cast<std::uint32_t>(i));", "unit|assets"),
    ("preferred images", "formats/gltf/gltf_materials.cpp", 'extension && extension->Has("source")',
     'extension && !extension->Has("source")', "unit"),
    ("partitions of UASTC", "formats/image/uastc_block.cpp", "seen |= 1U << subset;", "seen |= 2U << subset;",
     "unit"),
    ("history of selectors", "formats/image/basis_etc1s.cpp", "values_[index / 2], values_[index]",
     "values_[0], values_[index]", "unit"),
    ("meshopt filters", "formats/gltf/meshopt_view.cpp", "if (filter.decode) filter.decode(out",
     "if (false) filter.decode(out", "unit"),
    ("sRGB bytes", "formats/image/srgb_bytes.cpp", "begin = middle + 1;\n            else",
     "begin = middle + 2;\n            else", "unit"),
    ("forecast of a page", "formats/picture_forecast.cpp", "packed * 4 / 3;", "packed / 3;", "unit"),
    ("forecast beyond the disk", "cmd/options/forecast.cpp", "if (share.certain > share.disk.free)",
     "if (false)", "unit"),
    ("settings in words", "cmd/options/differences.cpp",
     "if (in_a && in_b && *in_a == *in_b) continue;", "if (in_a && in_b) continue;", "cli"),
    ("objects of a file", "core/image/layers.cpp",
     "return selection.objects.holds(idOf(objects, fragment)) &&", "return", "unit"),
    ("what is below an object", "cmd/options/object_options.cpp", "addBelow(names.parents, ids);", "",
     "cli"),
    ("light without coverage", "formats/image/display.cpp",
     "alpha + (1 - alpha) * beyond / (2 - least)", "alpha", "unit"),
    ("highlights of the meter", "formats/image/display.cpp", "std::min(halfway, std::log2",
     "std::max(halfway, std::log2", "unit"),
    ("margins", "core/scene/framing.cpp", "1 - 2 * kFramingMargin", "1 - kFramingMargin", "unit"),
    ("front of flat scenes", "core/scene/framing.cpp", "< kTurned) forward", "> kTurned) forward",
     "unit"),
    ("numbers of a legend", "formats/image/legend.cpp", "n * step < high - room", "n * step < high",
     "unit"),
    ("numbers of views", "formats/file/file_name.cpp", "numbered(path, view, kViewSign)",
     "numbered(path, view + 1, kViewSign)", "cli"),
    ("views of a chunk", "cmd/render/render_request.cpp", "(first_ + index) % views_.size()",
     "index % views_.size()", "cli"),
    ("sphere around the scene", "core/views/many_cameras.cpp", "radius / std::sin(narrow)",
     "radius / std::tan(narrow)", "unit"),
    ("size of a scene", "core/views/many_cameras.cpp", "result.scale = 1 / length;",
     "result.scale = 2 / length;", "unit"),
    ("corner or centre of a pixel", "formats/cameras/transforms_json.cpp",
     "return corner.value_or(pixels / 2.0) - 0.5;", "return corner.value_or(pixels / 2.0);", "unit"),
    ("pixel centre in Python", "cmd/python/scenes.cpp", "pixel_center.is_none() ? 0 :",
     "pixel_center.is_none() ? 0.5 :", "python"),
    ("work that was given up", "cmd/library/worker.cpp", "given_up_ = thrown != nullptr;", "", "gl|python"),
    ("bytes that belong to nothing", "formats/exr/exr_integrity.cpp",
     "if (place != file.size()) return {};", "", "unit"),
    ("exit code where nobody reads", "cmd/cli/errors.cpp", "return 128 + SIGPIPE;", "return 128;",
     "unit"),
)


def run(*command, **options):
    return subprocess.run(
        command, cwd=COPY, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
        **options,
    )


def copy_tree():
    """The tracked files as they are here; files that are the same keep their time, so that only what
    differs is compiled anew."""
    COPY.mkdir(parents=True, exist_ok=True)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=SOURCE, check=True, capture_output=True)
    for name in listed.stdout.decode().split("\0"):
        source, target = SOURCE / name, COPY / name
        if not source.is_file():
            continue
        content = source.read_bytes()
        if not target.exists() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            target.chmod(source.stat().st_mode)


def build():
    done = run("cmake", "--build", "--preset", "ci", "-j", str(os.cpu_count()))
    return "" if done.returncode == 0 else done.stdout[-3000:]


def seen_by(label):
    """The first test that fails; nothing if none does."""
    done = run("ctest", "--preset", "ci", "-L", label, "-j", str(os.cpu_count()), "--stop-on-failure",
               env={**os.environ, "GTEST_FAIL_FAST": "1", "GTEST_BRIEF": "1"})
    failed = [line for line in done.stdout.splitlines() if "[  FAILED  ]" in line]
    if done.returncode == 0:
        return ""
    return failed[0].partition("]")[2].strip() if failed else done.stdout[-300:].strip()


def main():
    chosen = [mutation for mutation in MUTATIONS if not sys.argv[1:] or mutation[0] in sys.argv[1:]]
    copy_tree()
    os.environ.setdefault("PEELER_ASSETS", str(SOURCE.parent / "shared" / "assets"))
    configured = run("cmake", "--preset", "ci", "-DPEELER_WERROR=OFF",
                     "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG")
    problem = configured.stdout[-3000:] if configured.returncode != 0 else build()
    if problem:
        print(problem)
        return 1

    unseen = 0
    for name, file, text, mutated, label in chosen:
        start = time.monotonic()
        path = COPY / file
        whole = path.read_text(encoding="utf-8")
        if whole.count(text) != 1:
            verdict = f"NOT TRIED: its text stands {whole.count(text)} times in {file}"
        else:
            path.write_text(whole.replace(text, mutated), encoding="utf-8")
            problem = build()
            red = "" if problem else seen_by(label)
            path.write_text(whole, encoding="utf-8")
            verdict = f"NOT BUILT: {problem}" if problem else f"red: {red}" if red else "NOT SEEN"
        unseen += not verdict.startswith("red")
        print(f"{name}: {verdict} ({time.monotonic() - start:.0f} s)", flush=True)
    print(f"{len(chosen) - unseen} of {len(chosen)} mutations were seen")
    return 1 if unseen else 0


if __name__ == "__main__":
    sys.exit(main())
