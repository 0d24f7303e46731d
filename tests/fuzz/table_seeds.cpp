// SPDX-License-Identifier: Apache-2.0
// Seeds for points and arrays, for camera files, and for pictures of random numbers.
#include <libdeflate.h>

#include <memory>
#include <random>

#include "cmd/batch/batch_report.h"
#include "formats/arrays/table_writers.h"
#include "formats/cameras/camera_files.h"
#include "fuzz/fuzz_target.h"
#include "fuzz/seeds.h"

namespace peeler::fuzz {
namespace {

using test::PackedNumbers;

/// Returns a ZIP with one member, deflated as by numpy.savez_compressed.
std::string packedZip(const std::string& name, const std::string& bytes) {
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(6), libdeflate_free_compressor);
    std::string packed(libdeflate_deflate_compress_bound(compressor.get(), bytes.size()), '\0');
    packed.resize(libdeflate_deflate_compress(compressor.get(), bytes.data(), bytes.size(),
                                              packed.data(), packed.size()));
    const auto fields = [&](PackedNumbers& to) {
        to.add<std::uint16_t>(0).add<std::uint16_t>(8).add<std::uint32_t>(0x00210000);
        to.add(libdeflate_crc32(0, bytes.data(), bytes.size()));
        to.add(static_cast<std::uint32_t>(packed.size()));
        to.add(static_cast<std::uint32_t>(bytes.size()));
        to.add(static_cast<std::uint16_t>(name.size())).add<std::uint16_t>(0);
    };
    PackedNumbers file;
    file.add<std::uint32_t>(0x04034B50).add<std::uint16_t>(20);
    fields(file);
    file.text += name + packed;
    const auto directory = static_cast<std::uint32_t>(file.text.size());
    file.add<std::uint32_t>(0x02014B50).add<std::uint32_t>(20 << 16 | 20);
    fields(file);
    file.add<std::uint32_t>(0).add<std::uint16_t>(0).add<std::uint32_t>(0).add<std::uint32_t>(0);
    file.text += name;
    const auto size = static_cast<std::uint32_t>(file.text.size()) - directory;
    file.add<std::uint32_t>(0x06054B50).add<std::uint32_t>(0).add<std::uint32_t>(1 << 16 | 1);
    file.add(size).add(directory).add<std::uint16_t>(0);
    return file.text;
}

std::string arraysFile(std::vector<NamedArray> arrays) {
    const std::string path = (scratchFolder() / "seed.npz").string();
    ArrayWriter writer(path, arrays);
    for (std::size_t i = 0; i < arrays.size(); ++i)
        writer.append(i, std::vector<std::byte>(arrays[i].bytes(), std::byte{0x3F}));
    writer.finish();
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void addPointSeeds(std::vector<SeedBytes>& seeds) {
    const std::string vertex =
        "element vertex 2\nproperty float x\nproperty double y\nproperty short z\nproperty list "
        "uchar int more\n";
    const std::string comment = "comment made by hand\n";
    seeds.push_back(seedOf("ply\nformat ascii 1.0\n" + comment + vertex +
                           "end_header\n1 2 3 2 7 8\n-4.5 5e3 6 0\n"));
    PackedNumbers numbers;
    for (int i = 0; i < 2; ++i)
        numbers.add(1.0F).add(2.0).add(std::int16_t{3}).add(std::uint8_t{1}).add(std::int32_t{9});
    for (const char* order : {"little", "big"})
        seeds.push_back(seedOf("ply\nformat binary_" + std::string(order) + "_endian 1.0\n" +
                               "element face 1\nproperty list uchar int vertex_indices\n" + vertex +
                               "end_header\n" + std::string(5, '\0') + numbers.text));
    seeds.push_back(seedOf(arraysFile(
        {{"points", NumberType::kFloat, {3, 3}}, {"output_hash", NumberType::kUint8, {16}}})));
    seeds.push_back(seedOf(arraysFile({{"other", NumberType::kDouble, {2, 3}}})));
    const std::string npy = test::npyText(">f4", "(2, 3)", std::string(24, '\0'), true);
    seeds.push_back(seedOf(npy));
    seeds.push_back(seedOf(test::npyText("<i8", "(2,)", std::string(16, 'a'))));
    seeds.push_back(seedOf(packedZip("points.npy", npy)));
}

void addCameraSeeds(std::vector<SeedBytes>& seeds) {
    const auto add = [&](char format, char convention, const std::string& files) {
        seeds.push_back(seedOf(std::string{format, convention, '\1'} + files));
    };
    add(0, 0, test::transformsText());
    add(0, 3,
        R"({"camera_angle_x": 0.8, "frames": [{"transform_matrix": [)" + test::kKnownBlenderRows +
            "]}]}");
    add(1, 0,
        test::bopText() + R"(%%%%{"width": 640, "height": 480}%%%%)" +
            R"({"7": [{"obj_id": 3, "cam_R_m2c": [1,0,0,0,1,0,0,0,1], "cam_t_m2c": [0,0,9]}]})");
    add(2, 0, test::colmapCamerasText() + "%%%%" + test::kColmapImagesText);
    add(2, 0,
        test::colmapCamerasText("SIMPLE_RADIAL 640 480 500 300 200 0") + "%%%%" +
            test::kColmapImagesText);
    add(3, 0, test::colmapCamerasBinary() + "%%%%" + test::colmapImagesBinary());
    add(4, 1, test::npyPoses(test::kKnownOpencv));
    add(4, 2, test::npyPoses(test::kKnownOpengl));
    add(5, 2, packedZip("poses.npy", test::npyPoses(test::kKnownOpengl)));
    add(5, 0,
        arraysFile({{"c2w", NumberType::kFloat, {1, 4, 4}},
                    {"K", NumberType::kDouble, {3, 3}},
                    {"size", NumberType::kInt64, {2}}}));
    add(6, 0, test::lineText("\"cameraToWorld\": [" + test::kKnownOpenglRows + "]"));
    add(6, 0,
        "{\"eye\": [1, 2, 3], \"target\": [0, 0, 0], \"up\": [0, 0, 1], \"fov\": 40, \"near\": "
        "0.1, \"far\": 9}\n{\"worldToCamera\": [" +
            test::kKnownOpencvRows + "], \"orthoHeight\": 3}\n");
}

}  // namespace

void addTableSeeds(Seeds& seeds) {
    addPointSeeds(seeds["points"]);
    addCameraSeeds(seeds["cameras"]);
    std::mt19937 random(1);
    for (const std::size_t size : {0, 40, 200, 900, 3000, 9000}) {
        SeedBytes bytes(size);
        for (std::uint8_t& byte : bytes)
            byte = static_cast<std::uint8_t>(random());
        seeds["round_trip"].push_back(std::move(bytes));
    }
}

}  // namespace peeler::fuzz
