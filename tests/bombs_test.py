# SPDX-License-Identifier: Apache-2.0
"""Tests that decompression bombs cost little time and memory, with every verb that reads them. Bombs are small files
that declare much data, or unpack to much data.

Each bomb makes its own files. A run is limited to SECONDS of processor time (plus the time that the machine takes to
allocate the memory) and to MEBIBYTES, or its --memory; its exit code must be an allowed one. Prints a table. PEELER is
the program. With PEELER_SANITIZE (a sanitizer build) there are no limits, because most of the cost is the sanitizer's;
with PEELER_COVERAGE (line counts) there is no time limit.
"""

import base64
import collections
import json
import os
import pathlib
import shlex
import struct
import subprocess
import sys
import tempfile
import traceback
import unittest
import zlib

import threemf_package

PEELER = os.environ.get("PEELER", "peeler")
ALL = os.environ.get("PEELER_TEST_ALL") is not None
SANITIZED = bool(os.environ.get("PEELER_SANITIZE"))
SLOWED = SANITIZED or bool(os.environ.get("PEELER_COVERAGE"))
SECONDS, MEBIBYTES = 2, 512
ENDLESS = 600 if SANITIZED else 60  # in seconds; a longer run is killed as hanging

# A bomb: its name, the function make(folder), the verb and its arguments with {} for the folder, the allowed exit
# codes, alternative texts of the message, and whether the short run includes the bomb.
Bomb = collections.namedtuple("Bomb", "name make command codes words short")
BOMBS = []


def bomb(command, codes=(3,), words="", short=True):
    def add(make):
        name = make.__name__.replace("_", " ")
        said = (words,) if isinstance(words, str) else words
        BOMBS.append(Bomb(name, make, shlex.split(command), codes, said, short))
        return make

    return add


# ---- 3MF


@bomb("info {}/scene.3mf", words="unpacks to more than")
def a_3MF_of_blanks(folder):
    model = threemf_package.model(" " * 50_000_000 + threemf_package.OBJECT)
    (folder / "scene.3mf").write_bytes(threemf_package.package(model))


@bomb("info {}/scene.3mf", codes=(0, 3))
def a_3MF_whose_part_is_larger_than_declared(folder):
    model = threemf_package.model(" " * 5_000_000 + threemf_package.OBJECT)
    declared = struct.pack("<I", len(model))
    (folder / "scene.3mf").write_bytes(threemf_package.package(model).replace(declared, struct.pack("<I", 1000)))


@bomb("info {}/scene.3mf", words="placed objects")
def a_million_components(folder):
    objects = threemf_package.OBJECT
    for i in (2, 3):
        objects += f'<object id="{i}"><components>' + f'<component objectid="{i - 1}"/>' * 1000 + "</components></object>"
    model = threemf_package.model(objects, build='<item objectid="3"/>')
    (folder / "scene.3mf").write_bytes(threemf_package.package(model))


# ---- Gaussian splats


@bomb("info {}/scene.spz", words="200 times its size")
def an_SPZ_of_zeros(folder):
    size = 900 << 20
    head = b"\x1f\x8b\x08" + bytes(7)
    (folder / "scene.spz").write_bytes(head + packed(size) + struct.pack("<II", 0, size))


@bomb("info {}/scene.spz", words="damaged")
def an_SPZ_that_hides_its_size(folder):
    (folder / "scene.spz").write_bytes(b"\x1f\x8b\x08" + bytes(7) + packed(900 << 20) + struct.pack("<II", 0, 1000))


@bomb("info {}/scene.ply", words="ends before")
def a_PLY_of_2_to_the_60_splats(folder):
    names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 1152921504606846976\n"
    header += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    (folder / "scene.ply").write_bytes(header.encode() + bytes(1000))


@bomb("render {}/scene.splat -o {}/out.png --size 16x16 --memory 256M", codes=(33,), words="memory budget")
def a_splat_of_half_a_gigabyte(folder):
    with open(folder / "scene.splat", "wb") as file:
        file.truncate(512 << 20)


# ---- glTF


TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def triangle():
    """Returns a scene with one triangle, whose bytes are in a data URI."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(TRIANGLE).decode()
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": uri}],
    }


def write(folder, scene, **texts):
    """Writes scene.gltf. `texts` replace the strings "@NAME" in it; each yields pieces of text."""
    with open(folder / "scene.gltf", "w", encoding="utf-8") as file:
        rest = json.dumps(scene)
        for name, pieces in texts.items():
            before, _, rest = rest.partition(f'"@{name}"')
            file.write(before)
            for piece in pieces:
                file.write(piece)
        file.write(rest)


def repeated(piece, count, separator=","):
    """Yields `piece` `count` times, in larger blocks."""
    block = 10000
    for done in range(0, count, block):
        yield (separator if done else "") + separator.join([piece] * min(block, count - done))


@bomb("info {}/scene.gltf", words="nested deeper")
def deep_json(folder):
    write(folder, {"asset": {"version": "2.0"}, "extras": "@deep"}, deep=("[" * 5000000, "]" * 5000000))


@bomb("info {}/scene.gltf", words="not valid JSON")
def a_line_feed_in_20_MB_of_text(folder):
    scene = triangle()
    scene["buffers"][0]["uri"] = "@uri"
    write(folder, scene, uri=('"data:;base64,', "A" * 20000000, "\n", '"'))


@bomb("info {}/scene.gltf", codes=(0, 3))
def a_name_of_20_MB(folder):
    scene = triangle()
    scene["extensionsUsed"] = ["@name"]
    write(folder, scene, name=('"', "x" * 20000000, '"'))


@bomb("info {}/scene.gltf", words="levels")
def a_chain_of_nodes(folder):
    scene = triangle()
    count = 1000000 if ALL else 100000
    scene["nodes"] = ["@nodes", {"mesh": 0}]
    scene["scenes"] = [{"nodes": [0]}]
    write(folder, scene, nodes=(("," if i else "") + f'{{"children":[{i + 1}]}}' for i in range(count - 1)))


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 512M", codes=(33,), words="memory budget", short=False)
def three_million_empty_nodes(folder):
    scene = triangle()
    scene["nodes"] = [{"mesh": 0}, "@nodes"]
    write(folder, scene, nodes=repeated("{}", 3000000))


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 512M", codes=(33,), words="memory budget", short=False)
def ten_million_numbers(folder):
    scene = triangle()
    scene["extras"] = ["@numbers"]
    write(folder, scene, numbers=repeated("0", 20000000))


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 512M", codes=(33,), words="memory budget")
def five_million_instances(folder):
    scene = triangle()
    count = 5000000
    scene["extensionsUsed"] = scene["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    scene["accessors"].append({"componentType": 5126, "count": count, "type": "VEC3", "bufferView": 1})
    scene["bufferViews"].append({"buffer": 1, "byteLength": 12 * count})
    scene["buffers"].append({"byteLength": 12 * count, "uri": "zeros.bin"})
    with open(folder / "zeros.bin", "wb") as file:
        file.truncate(12 * count)
    scene["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}
    write(folder, scene)


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 256M", codes=(33,), words="memory budget")
def a_thousand_primitives_of_the_same_bytes(folder):
    scene = triangle()
    count = 300000
    scene["accessors"][0]["count"] = count
    scene["bufferViews"][0]["byteLength"] = scene["buffers"][0]["byteLength"] = 12 * count
    scene["buffers"][0]["uri"] = "zeros.bin"
    with open(folder / "zeros.bin", "wb") as file:
        file.truncate(12 * count)
    scene["accessors"][0]["max"] = [0, 0, 0]
    scene["meshes"][0]["primitives"] *= 1000
    write(folder, scene)


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 256M", codes=(33,), words="memory budget")
def a_thousand_targets_of_the_same_bytes(folder):
    scene = triangle()
    count = 300000
    scene["accessors"][0]["count"] = count
    scene["bufferViews"][0]["byteLength"] = scene["buffers"][0]["byteLength"] = 12 * count
    scene["buffers"][0]["uri"] = "zeros.bin"
    with open(folder / "zeros.bin", "wb") as file:
        file.truncate(12 * count)
    scene["accessors"][0]["max"] = [0, 0, 0]
    scene["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}] * 1000
    write(folder, scene)


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 256M", codes=(33,), words="memory budget")
def ten_thousand_samplers_of_the_same_bytes(folder):
    scene = triangle()
    count, samplers = 100000, 10000
    scene["buffers"].append({"byteLength": 16 * count, "uri": "zeros.bin"})
    with open(folder / "zeros.bin", "wb") as file:
        file.truncate(16 * count)
    scene["bufferViews"].append({"buffer": 1, "byteLength": 16 * count})
    for kind in ("SCALAR", "VEC3"):
        scene["accessors"].append({"bufferView": 1, "componentType": 5126, "count": count, "type": kind})
        if kind == "SCALAR":
            scene["accessors"][-1].update(min=[0], max=[0])
    scene["animations"] = [
        {
            "samplers": [{"input": 1, "output": 2}] * samplers,
            "channels": [{"sampler": i, "target": {"node": 0, "path": "translation"}} for i in range(samplers)],
        }
    ]
    write(folder, scene)


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 512M", codes=(33,), words="memory budget", short=False)
def a_skin_of_five_million_joints(folder):
    scene = triangle()
    scene["skins"] = [{"joints": ["@joints"]}]
    write(folder, scene, joints=repeated("0", 5000000))


@bomb("info {}/scene.gltf", codes=(0, 3))
def a_thousand_buffers_of_one_file(folder):
    scene = triangle()
    size = 4 << 20
    with open(folder / "zeros.bin", "wb") as file:
        file.truncate(size)
    scene["buffers"] += [{"byteLength": size, "uri": "zeros.bin"}] * 1000
    write(folder, scene)


@bomb("info {}/scene.glb", codes=(0, 3), short=False)
def two_million_chunks(folder):
    text = json.dumps(triangle()).encode()
    text += b" " * (-len(text) % 4)
    count = 2000000
    with open(folder / "scene.glb", "wb") as file:
        file.write(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + 8 * count, len(text), 0x4E4F534A) + text)
        for _ in range(count // 10000):
            file.write(struct.pack("<II", 0, 0x004E4942) * 10000)


def textured(folder, name, data, copies=1):
    scene = triangle()
    (folder / name).write_bytes(data)
    scene["images"] = [{"uri": name}] * copies
    scene["textures"] = [{"source": i} for i in range(copies)]
    scene["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}} for i in range(copies)]
    scene["meshes"][0]["primitives"] = [
        {"attributes": {"POSITION": 0}, "material": i} for i in range(copies)
    ]
    write(folder, scene)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def packed(size):
    """Returns `size` zeros deflated to a thousandth of the size: the same compressed MiB repeated."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    mebibyte = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    return mebibyte * (size >> 20) + packer.compress(bytes(size % (1 << 20))) + packer.flush()


def deflated(size):
    """Returns packed(size) in zlib's format."""
    return b"\x78\xda" + packed(size) + struct.pack(">I", size % 65521 << 16 | 1)


def png(width, height, *before, color=0, pixels=b""):
    header = struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + b"".join(before)
        + chunk(b"IDAT", pixels)
        + chunk(b"IEND", b"")
    )


@bomb("info {}/scene.gltf", codes=(0,), words="60000 x 60000")
def a_texture_of_60000_square(folder):
    textured(folder, "huge.png", png(60000, 60000))


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 512M", codes=(33,), words="memory budget", short=False)
def a_texture_of_16000_square(folder):
    textured(folder, "large.png", png(16000, 16000, pixels=deflated(16001 * 16000)))


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 256M", codes=(33,), words="memory budget")
def a_hundred_textures_of_one_picture(folder):
    textured(folder, "large.png", png(2000, 2000, pixels=deflated(2001 * 2000)), 100)


@bomb("info {}/scene.gltf", codes=(0, 3))
def a_PNG_of_a_million_chunks(folder):
    textured(folder, "chunks.png", png(1, 1, *([chunk(b"tEXt", b"a\0b")] * 1000000), pixels=zlib.compress(b"\0\0")))


@bomb("info {}/scene.gltf", codes=(0, 3))
def a_PNG_of_texts_that_inflate(folder):
    text = chunk(b"zTXt", b"a\0\0" + deflated(60 << 20))
    textured(folder, "texts.png", png(1, 1, *([text] * 100), pixels=zlib.compress(b"\0\0")))


@bomb("info {}/scene.gltf", codes=(0, 3))
def a_PNG_of_a_profile_that_inflates(folder):
    profile = chunk(b"iCCP", b"a\0\0" + deflated(1 << 30))
    textured(folder, "profile.png", png(1, 1, profile, pixels=zlib.compress(b"\0\0")))


def segment(marker, data):
    return bytes((0xFF, marker)) + struct.pack(">H", 2 + len(data)) + data


def jpeg(width, height, scans):
    """Returns a progressive JPEG of grey zeros, whose scans are runs of end-of-band codes."""
    counts = bytes(16)
    dc = segment(0xC4, b"\0" + bytes([1] + [0] * 15) + b"\0")  # the only code, "0", means a difference of 0 bits
    # The table of AC codes: 15 codes of 5 bits, EOB0 to EOB14, each for a run of blocks.
    ac = segment(0xC4, b"\x10" + bytes([0] * 4 + [15] + [0] * 11) + bytes(i << 4 for i in range(15)))
    blocks = -(-width // 8) * -(-height // 8)
    first = segment(0xDA, b"\x01\x01\x00\x00\x00\x00") + bytes(-(-blocks // 8))
    bits = ""
    left = blocks
    while left:
        power = min(14, left.bit_length() - 1)
        run = min(left, (1 << (power + 1)) - 1)
        bits += f"{power:05b}" + (f"{run - (1 << power):0{power}b}" if power else "")
        left -= run
    bits += "1" * (-len(bits) % 8)
    data = bytes(int(bits[i : i + 8], 2) for i in range(0, len(bits), 8)).replace(b"\xff", b"\xff\0")
    more = segment(0xDA, b"\x01\x01\x00\x01\x3f\x00") + data
    return (
        b"\xff\xd8"
        + segment(0xDB, b"\0" + bytes([1] * 64))
        + segment(0xC2, struct.pack(">BHHB", 8, height, width, 1) + b"\x01\x11\0")
        + dc
        + ac
        + first
        + more * scans
        + b"\xff\xd9"
    )


@bomb("info {}/scene.gltf", codes=(0, 3))
def a_JPEG_of_ten_thousand_scans(folder):
    textured(folder, "scans.jpg", jpeg(4096, 4096, 10000))


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 512M", codes=(33,), words="memory budget")
def a_WebP_of_16000_square(folder):
    data = b"VP8L" + struct.pack("<IBI", 105, 0x2F, 15999 | 15999 << 14) + bytes(101)
    textured(folder, "large.webp", b"RIFF" + struct.pack("<I", 4 + len(data)) + b"WEBP" + data)


def ktx2(side, scheme, model, level, unpacked, channels=(3,), data=b""):
    """Returns a KTX2 file with one level."""
    samples = b"".join(struct.pack("<IIII", 127 << 16 | channel << 24, 0, 0, 0xFFFFFFFF) for channel in channels)
    block = struct.pack("<IHHIIII", 0, 2, 24 + len(samples), model | 0x020100, 0x0303, 16, 0) + samples
    described = 80 + 24
    rest = described + 4 + len(block)
    return (
        b"\xabKTX 20\xbb\r\n\x1a\n"
        + struct.pack("<9I", 0, 1, side, side, 0, 0, 1, 1, scheme)
        + struct.pack("<4I2Q", described, 4 + len(block), 0, 0, rest if data else 0, len(data))
        + struct.pack("<3Q", rest + len(data), len(level), unpacked)
        + struct.pack("<I", 4 + len(block))
        + block
        + data
        + level
    )


def zstandard(count):
    """Returns a Zstandard frame of `count` blocks; each repeats one byte for 128 KiB, the maximum."""
    blocks = [struct.pack("<I", (i == count - 1) | 1 << 1 | 0x20000 << 3)[:3] + b"\0" for i in range(count)]
    return b"\x28\xb5\x2f\xfd\xa0" + struct.pack("<I", count << 17) + b"".join(blocks)


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --memory 512M", codes=(33,), words="memory budget")
def a_KTX2_of_16384_square(folder):
    textured(folder, "large.ktx2", ktx2(16384, 2, 166, zstandard(2048), 2048 << 17))


@bomb("info {}/scene.gltf", codes=(0,), words="")
def a_KTX2_that_inflates(folder):
    textured(folder, "inflates.ktx2", ktx2(4096, 2, 166, zstandard(128), 128 << 17))


@bomb("info {}/scene.gltf", codes=(0,), words="")
def a_KTX2_of_codebooks_that_are_not_there(folder):
    data = struct.pack("<2H4I5I", 65535, 65535, 4, 4, 4, 0, 0, 0, 1, 0, 0) + bytes(12)
    textured(folder, "codebooks.ktx2", ktx2(4096, 1, 163, b"\0", 0, (0,), data))


@bomb("info {}/scene.gltf", words="")
def meshopt_of_nothing(folder):
    scene = triangle()
    count = 50000000
    scene["extensionsUsed"] = ["EXT_meshopt_compression"]
    scene["buffers"].append({"byteLength": 1})
    scene["bufferViews"][0] = {
        "buffer": 1,
        "byteLength": 16 * count,
        "extensions": {
            "EXT_meshopt_compression": {
                "buffer": 0, "byteLength": 36, "count": count, "byteStride": 16, "mode": "ATTRIBUTES"
            }
        },
    }
    write(folder, scene)


def varint(number):
    out = b""
    while number > 127:
        out += bytes([number & 127 | 128])
        number >>= 7
    return out + bytes([number])


# A Draco symbol decoder (rANS, https://google.github.io/draco/spec/) with a single symbol of probability 1. The symbols
# take no bits.
NOTHING = bytes([1, 1]) + varint(1) + bytes([1, 64]) + varint(1) + b"\0"


def draco_header(method, flags=0):
    return b"DRACO" + bytes([2, 2, 1, method]) + struct.pack("<H", flags)


def draco(folder, data, count, primitives=1, fallback=False):
    """Writes a scene of primitives with `count` triangles each. Each primitive has its own accessors, but all
    primitives share the Draco data."""
    scene = triangle()
    (folder / "mesh.drc").write_bytes(data)
    scene["extensionsUsed"] = ["KHR_draco_mesh_compression"]
    scene["buffers"] = [{"byteLength": len(data), "uri": "mesh.drc"}]
    scene["bufferViews"] = [{"buffer": 0, "byteLength": len(data)}]
    positions = {"componentType": 5126, "count": 3 * count, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]}
    indices = {"componentType": 5125, "count": 3 * count, "type": "SCALAR"}
    if fallback:
        positions["bufferView"] = indices["bufferView"] = 1
        scene["buffers"].append({"byteLength": 36 * count, "uri": "zeros.bin"})
        scene["bufferViews"].append({"buffer": 1, "byteLength": 36 * count})
        with open(folder / "zeros.bin", "wb") as file:
            file.truncate(36 * count)
    else:
        scene["extensionsRequired"] = scene["extensionsUsed"]
    scene["accessors"] = [positions, indices] * primitives
    compressed = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    scene["meshes"][0]["primitives"] = [
        {"attributes": {"POSITION": 2 * i}, "indices": 2 * i + 1, "extensions": compressed} for i in range(primitives)
    ]
    write(folder, scene)


def edgebreaker(symbols):
    """Returns connectivity made of these symbols, in decoding order, with no data after them."""
    codes = {"C": "0", "S": "100", "L": "110", "R": "101", "E": "111"}
    bits = "".join(codes[symbol] for symbol in symbols)
    bits += "0" * (-len(bits) % 8)
    packed = bytes(int(bits[i : i + 8][::-1], 2) for i in range(0, len(bits), 8))
    vertices, faces, splits = 3 * symbols.count("E"), len(symbols), symbols.count("S")
    counts = varint(vertices) + varint(faces) + b"\0" + varint(faces) + varint(splits) + varint(0)
    starts = b"\xff" + varint(1) + b"\0"
    return draco_header(1) + b"\0" + counts + varint(len(packed)) + packed + starts


def quadratic(count):
    """Returns about 4 * `count` triangles that merge with a vertex one by one. For each of them, the decoder visits all
    triangles of the vertex."""
    return edgebreaker("E" * count + "SCC" * (count - 1))


def values_without_bits(faces, attributes):
    """Returns attributes with four numbers for each of three vertices per triangle. NOTHING codes all values of an
    attribute in seven bytes."""
    described = b"".join(b"\0\5\4\0" + varint(i) for i in range(attributes)) + b"\1" * attributes
    counts = varint(faces) + varint(3 * faces) + b"\0" + NOTHING + b"\1" + varint(attributes)
    return draco_header(0) + counts + described + (b"\xfe\1" + NOTHING) * attributes + bytes(3 * faces)


@bomb("info {}/scene.gltf", words="accessors have room")
def Draco_of_a_billion_triangles(folder):
    draco(folder, draco_header(0) + varint(1 << 30) + varint(1 << 30) + bytes(64), 1 << 20)


@bomb("info {}/scene.gltf", words="100000000 triangles in")
def Draco_of_100_million_triangles(folder):
    faces = 100000000
    data = draco_header(1) + b"\0" + varint(3 * faces) + varint(faces) + b"\0" + varint(faces) + varint(faces)
    draco(folder, data + bytes(1 << 20), faces)


@bomb("info {}/scene.gltf", words="damaged")
def Draco_of_endless_metadata(folder):
    # Each block of metadata contains another block.
    inner = varint(0) + varint(1) + b"\x01a"
    draco(folder, draco_header(1, 0x8000) + varint(0) + inner * 2000000, 1 << 20)


@bomb("info {}/scene.gltf", words="damaged")
def Draco_of_faces_without_data(folder):
    faces = 8000000
    data = draco_header(1) + b"\0" + varint(faces) + varint(faces) + b"\0" + varint(faces) + varint(0)
    draco(folder, data + bytes(1 << 20), faces)


# Without a memory limit, or if the machine allocates memory slowly, the time limit applies first.
@bomb("info {}/scene.gltf", words=("longer than 1 s", "too much memory"))
def Draco_of_values_without_bits(folder):
    draco(folder, values_without_bits(80000, 100), 80000)


@bomb(
    "render {}/scene.gltf -o {}/out.png --size 16x16 --memory 256M",
    codes=(3, 33) if SANITIZED else (33,),
    words=("longer than 5 s", "memory budget") if SANITIZED else "memory budget",
)
def Draco_of_more_values_without_bits(folder):
    draco(folder, values_without_bits(1000000, 100), 1000000)


@bomb("info {}/scene.gltf", words="longer than 1 s")
def Draco_that_loops(folder):
    draco(folder, quadratic(60000), 240000)


@bomb("info {}/scene.gltf", words="longer than 1 s")
def Draco_that_loops_for_accessors_of_100_million(folder):
    draco(folder, quadratic(60000), 100000000)


@bomb("info {}/scene.gltf", codes=(0,), words="decoding the Draco data takes too long")
def Draco_that_loops_for_every_primitive(folder):
    draco(folder, quadratic(5000), 20000, 24, fallback=True)


# ---- OpenEXR


def attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def exr_header(width=1, height=1, kind="scanlineimage", compression=0, more=b"", channels="RGBAZ", name="", chunks=1):
    listed = b"".join(
        c.encode() + b"\0" + struct.pack("<iB3xii", 2 if c == "Z" else 1, 0, 1, 1) for c in sorted(channels)
    )
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    return (
        attribute("channels", "chlist", listed + b"\0")
        + attribute("chunkCount", "int", struct.pack("<i", chunks))
        + attribute("compression", "compression", bytes([compression]))
        + attribute("dataWindow", "box2i", window)
        + attribute("displayWindow", "box2i", window)
        + attribute("lineOrder", "lineOrder", b"\0")
        + (attribute("name", "string", name.encode()) if name else b"")
        + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
        + attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
        + attribute("screenWindowWidth", "float", struct.pack("<f", 1))
        + attribute("type", "string", kind.encode())
        + more
        + b"\0"
    )


def exr(path, headers, flags, rest=b""):
    with open(path, "wb") as file:
        file.write(struct.pack("<II", 20000630, 2 | flags))
        for header in headers:
            file.write(header)
        file.write(rest)


MULTIPART, DEEP, LONG = 0x1000, 0x800, 0x400


@bomb("info {}/a.exr")
def an_EXR_of_200000_parts(folder):
    headers = (exr_header(name=f"layer_{i:06}") for i in range(200000))
    exr(folder / "a.exr", headers, MULTIPART, b"\0")


@bomb("info {}/a.exr")
def an_EXR_part_of_2_to_the_31_chunks(folder):
    exr(folder / "a.exr", [exr_header(name="layer_000", chunks=(1 << 31) - 1)], MULTIPART, b"\0" + bytes(1000))


@bomb("info {}/a.exr")
def an_EXR_of_a_million_attributes(folder):
    more = b"".join(attribute(f"a{i}", "int", b"\0\0\0\0") for i in range(1000000))
    exr(folder / "a.exr", [exr_header(name="layer_000", more=more)], MULTIPART, b"\0")


@bomb("info {}/a.exr")
def an_EXR_attribute_of_2_GB(folder):
    more = b"a\0string\0" + struct.pack("<i", (1 << 31) - 1)
    exr(folder / "a.exr", [exr_header(name="layer_000")[:-1] + more], MULTIPART)


@bomb("info {}/a.exr")
def an_EXR_of_131072_square(folder):
    header = exr_header(131071, 131071, compression=3, name="layer_000", chunks=8192)
    exr(folder / "a.exr", [header], MULTIPART, b"\0" + bytes(8 * 8192))


@bomb("flatten {}/a.exr -o {}/out.png")
def an_EXR_tile_of_131072_square(folder):
    tiles = attribute("tiles", "tiledesc", struct.pack("<IIB", 131072, 131072, 0))
    header = exr_header(1, 1, "tiledimage", 3, tiles)
    exr(folder / "a.exr", [header], 0x200, bytes(1000))


@bomb("flatten {}/a.exr -o {}/out.png")
def an_EXR_block_of_256_rows_of_131072(folder):
    header = exr_header(131072, 1, compression=9)
    exr(folder / "a.exr", [header], 0, bytes(1000))


@bomb("flatten {}/a.exr -o {}/out.png")
def an_EXR_display_window_of_100000_square(folder):
    window = struct.pack("<4i", 0, 0, 99999, 99999)
    header = exr_header().replace(
        attribute("displayWindow", "box2i", bytes(16)), attribute("displayWindow", "box2i", window)
    )
    start = 8 + len(header) + 8
    line = struct.pack("<ii", 0, 12) + bytes(12)
    exr(folder / "a.exr", [header], 0, struct.pack("<Q", start) + line)


@bomb("info {}/a.exr", codes=(0, 3))
def an_EXR_manifest_that_inflates(folder):
    size = 900 << 20
    manifest = struct.pack("<Q", size) + deflated(size)
    more = attribute("idManifest", "idmanifest", manifest)
    header = exr_header(name="layer_000", more=more)
    line = struct.pack("<iii", 0, 0, 12) + bytes(12)
    start = 8 + len(header) + 1 + 8
    exr(folder / "a.exr", [header], MULTIPART, b"\0" + struct.pack("<Q", start) + line)


@bomb("flatten {}/a.exr -o {}/out.png")
def a_deep_EXR_of_a_billion_samples(folder):
    width = 1000
    version = attribute("version", "int", struct.pack("<i", 1))
    header = exr_header(width, 1, "deepscanline", 2, version, "RGBAZ", "color")
    counts = zlib.compress(struct.pack(f"<{width}I", *(1000000 * (i + 1) for i in range(width))))
    samples = zlib.compress(bytes(1000))
    start = 8 + len(header) + 1 + 8
    line = struct.pack("<iiQQQ", 0, 0, len(counts), len(samples), 12 * 1000000 * width) + counts + samples
    exr(folder / "a.exr", [header], MULTIPART | DEEP, b"\0" + struct.pack("<Q", start) + line)


@bomb("render {}/scene.gltf -o {}/out.png --size 16x16 --environment {}/a.hdr")
def an_environment_of_60000_square(folder):
    write(folder, triangle())
    (folder / "a.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n" + bytes(100))


# ---- arrays, points, cameras, jobs


def zip_of(path, name, size):
    """Writes an archive with one deflated member: the header of an array of floats, then zeros."""
    values = size // 8 // 3
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({values}, 3), }}"
    text += " " * (-(len(text) + 11) % 64) + "\n"
    npy = b"\x93NUMPY\x01\0" + struct.pack("<H", len(text)) + text.encode()
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = packer.compress(npy) + packer.flush(zlib.Z_FULL_FLUSH) + packed(24 * values)
    crc, block, total = zlib.crc32(npy), bytes(24 << 16), len(npy) + 24 * values
    for left in range(24 * values, 0, -len(block)):
        crc = zlib.crc32(block[:left], crc)
    shared = struct.pack("<HHHHHIIIHH", 20, 0, 8, 0, 33, crc, len(data), total, len(name), 0)
    local = b"PK\3\4" + shared + name
    entry = b"PK\1\2" + struct.pack("<H", 20) + shared + struct.pack("<HHHII", 0, 0, 0, 0, 0) + name
    end = b"PK\5\6" + struct.pack("<HHHHIIH", 0, 0, 1, 1, len(entry), len(local) + len(data), 0)
    path.write_bytes(local + data + entry + end)


@bomb("rays {}/scene.gltf --direction 0,0,1 --points {}/points.npz -o {}/out.npz --memory 512M", codes=(3, 33))
def an_NPZ_that_inflates(folder):
    write(folder, triangle())
    zip_of(folder / "points.npz", b"points.npy", 1 << 30)


@bomb("rays {}/scene.gltf --direction 0,0,1 --points {}/points.npy -o {}/out.npz")
def an_NPY_of_2_to_the_60(folder):
    write(folder, triangle())
    text = "{'descr': '<f8', 'fortran_order': False, 'shape': (1152921504606846976, 3), }".ljust(117) + "\n"
    (folder / "points.npy").write_bytes(b"\x93NUMPY\x01\0" + struct.pack("<H", len(text)) + text.encode() + bytes(64))


@bomb("rays {}/scene.gltf --direction 0,0,1 --points {}/points.ply -o {}/out.npz")
def a_PLY_of_2_to_the_60(folder):
    write(folder, triangle())
    (folder / "points.ply").write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 1152921504606846976\n"
        b"property double x\nproperty double y\nproperty double z\nend_header\n" + bytes(240)
    )


@bomb("render {}/scene.gltf -o {}/out.@@@@.png --size 16x16 --cameras {}/transforms.json")
def cameras_of_deep_JSON(folder):
    write(folder, triangle())
    with open(folder / "transforms.json", "w", encoding="utf-8") as file:
        file.write('{"frames":' + "[" * 5000000 + "]" * 5000000 + "}")


@bomb("batch {}/jobs", codes=(2, 3))
def jobs_of_deep_JSON(folder):
    with open(folder / "jobs", "w", encoding="utf-8") as file:
        file.write('{"verb":' + "[" * 5000000 + "]" * 5000000 + "}\n")


@bomb("flatten {}/pipe -o {}/out.png", words="not a regular file")
def a_pipe(folder):
    os.mkfifo(folder / "pipe")


@bomb("info /dev/zero", words="not a regular file")
def an_endless_device(_):
    pass


# ---- running


Run = collections.namedtuple("Run", "code seconds mebibytes out err")


def make_apart(make, folder):
    """Makes the files in a separate process, because the peak resident memory of this process is included in that of
    its later children."""
    child = os.fork()
    if child == 0:
        try:
            make(folder)
            os._exit(0)
        except BaseException:  # pylint: disable=broad-except
            traceback.print_exc()
            os._exit(1)
    _, status = os.waitpid(child, 0)
    if status != 0:
        raise RuntimeError(f"{make.__name__} makes no files")


def run(command, folder):
    """Runs the program, and measures its time and memory, including its children."""
    words = [word.replace("{}", str(folder)) for word in command]
    out, err = folder / "stdout", folder / "stderr"
    with open(out, "wb") as stdout, open(err, "wb") as stderr:
        child = subprocess.Popen([PEELER, *words], stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr)
        timer = subprocess.Popen(["sleep", str(ENDLESS)])
        try:
            pid, status, used = wait_for_one(child.pid, timer.pid)
            if pid != child.pid:
                child.kill()
                _, status, used = os.wait4(child.pid, 0)
        finally:
            timer.kill()
            try:
                timer.wait()
            except ChildProcessError:
                pass
        child.returncode = os.waitstatus_to_exitcode(status)
    return Run(
        child.returncode,
        used.ru_utime + used.ru_stime,
        used.ru_maxrss / 1024,
        out.read_bytes(),
        err.read_bytes(),
    )


PAGES = """
import ctypes, mmap, time
size = 64 << 20
def seconds():
    room = mmap.mmap(-1, size)
    start = time.process_time()
    ctypes.memset(ctypes.addressof(ctypes.c_char.from_buffer(room)), 1, size)
    return time.process_time() - start
print(min(seconds() for _ in range(3)) / (size >> 20))
"""


def seconds_a_mebibyte():
    """Returns the processor time that the machine takes to allocate a MiB of memory. In virtual machines, this can be
    most of the time of a program that fills 512 MB. Measures in a separate process, like make_apart()."""
    return float(subprocess.run([sys.executable, "-B", "-c", PAGES], capture_output=True, check=True).stdout)


def wait_for_one(*pids):
    while True:
        pid, status, used = os.wait3(0)
        if pid in pids:
            return pid, status, used


class Bombs(unittest.TestCase):
    def test_all(self):
        rows = [("bomb", "verb", "exit", "seconds", "MB", "its first line")]
        errors = []
        only = os.environ.get("PEELER_BOMBS")
        of_memory = seconds_a_mebibyte()
        for each in BOMBS:
            if not (each.short or ALL or only) or (only and only not in each.name):
                continue
            with tempfile.TemporaryDirectory(prefix="bomb") as name:
                folder = pathlib.Path(name)
                make_apart(each.make, folder)
                ran = run(each.command, folder)
            said = ran.err.decode("utf-8", "replace").replace(str(folder), "…")
            first = said.splitlines()[0] if said else ""
            rows.append(
                (each.name, each.command[0], str(ran.code), f"{ran.seconds:.2f}", f"{ran.mebibytes:.0f}", first[:120])
            )
            faults = []
            if ran.code not in each.codes:
                faults.append(f"exit code {ran.code}")
            told = said + ran.out.decode("utf-8", "replace")
            if not any(words in told for words in each.words):
                faults.append("it does not say " + " or ".join(f'"{words}"' for words in each.words))
            if ran.seconds > SECONDS + of_memory * ran.mebibytes and not SLOWED:
                faults.append(f"{ran.seconds:.1f} s")
            if ran.mebibytes > MEBIBYTES and not SANITIZED:
                faults.append(f"{ran.mebibytes:.0f} MB")
            if len(ran.err) + len(ran.out) > 100000:
                faults.append(f"{len(ran.err) + len(ran.out)} bytes said")
            if faults:
                errors.append(f"{each.name}: {', '.join(faults)}\n    {said[:300]}")
        widths = [max(len(row[i]) for row in rows) for i in range(5)]
        for row in rows:
            print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)) + "  " + row[5])
        print(f"{1000 * of_memory:.2f} ms for every MB are the machine's, which hands it out, and not counted")
        print(f"left out: {sum(not b.short for b in BOMBS) if not ALL else 0} of {len(BOMBS)} (PEELER_TEST_ALL=1)")
        if SLOWED:
            print(f"left out: {'what they take' if SANITIZED else 'their seconds'}, not the product's in such a build")
        if errors:
            self.fail("\n" + "\n".join(errors))


if __name__ == "__main__":
    unittest.main()
