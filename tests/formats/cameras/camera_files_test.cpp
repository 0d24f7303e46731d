// SPDX-License-Identifier: Apache-2.0
// Tests camera files of other programs. The same known camera is in the files of every format.
#include <cmath>
#include <functional>

#include "cmd/batch/batch_report.h"
#include "core/scene/view.h"
#include "formats/cameras/camera_files.h"
#include "support/python.h"

namespace peeler::test {
namespace {

using Convention = CameraConvention;

FileCamera only(const std::filesystem::path& path, const CameraFileOptions& options = {}) {
    std::vector<FileCamera> cameras = readCameras(path, options);
    EXPECT_EQ(cameras.size(), 1U) << path;
    return cameras.empty() ? FileCamera{} : cameras.front();
}

void expectKnown(const FileCamera& camera, const std::string& which) {
    EXPECT_EQ(camera.camera_to_world, knownPose()) << which;
    EXPECT_EQ(camera.intrinsics, kKnownLens) << which;
    EXPECT_EQ(camera.size, kKnownSize) << which;
    // OpenCV's formula gives the pixel of a point 10 in front of the camera, 3 to the right and 2
    // down.
    const glm::dvec3 point(1 - 10, 2 + 3, 5 - 2);
    const View view = viewOfCamera(camera);
    const glm::dvec4 own = glm::inverse(view.camera_to_world) * glm::dvec4(point, 1);
    const glm::dvec2 seen =
        PixelRays(view).pixel(own) - view.sample - glm::dvec2(view.crop.x0, view.crop.y0);
    EXPECT_NEAR(seen.x, 500 * 3.0 / 10 + 300.25, 1e-9) << which;
    EXPECT_NEAR(seen.y, 400 * 2.0 / 10 + 200.5, 1e-9) << which;
}

TEST(CameraFiles, OneCameraOfEveryFormat) {
    const ScratchDir scratch;
    put(scratch / "bop/scene/camera.json", R"({"width": 640, "height": 480, "fx": 1})");
    put(scratch / "model/cameras.txt", colmapCamerasText());
    put(scratch / "model/images.txt", kColmapImagesText);
    put(scratch / "model.bin/cameras.bin", colmapCamerasBinary());
    put(scratch / "model.bin/images.bin", colmapImagesBinary());
    const CameraFileOptions blender{Convention::kBlender, {}};
    const FileCamera transforms = only(put(scratch / "transforms.json", transformsText()));
    expectKnown(transforms, "transforms.json");
    EXPECT_EQ(transforms.name, "a.b");
    EXPECT_EQ(transforms.picture, "./images/a.b.png");
    expectKnown(only(scratch / "transforms.json", {Convention::kOpengl, {}}), "of OpenGL");
    expectKnown(only(put(scratch / "z.json", transformsText(kKnownBlenderRows)), blender),
                "z.json");

    const FileCamera bop = only(put(scratch / "bop/scene/scene_camera.json", bopText()));
    expectKnown(bop, "BOP");
    EXPECT_EQ(bop.name, "000007");
    expectKnown(only(scratch / "bop/scene/scene_camera.json", {Convention::kOpencv, {}}), "BOP");

    for (const char* path : {"model", "model/cameras.txt", "model/images.txt", "model.bin",
                             "model.bin/images.bin", "model/points3D.txt"}) {
        const FileCamera camera = only(scratch / path);
        expectKnown(camera, path);
        EXPECT_EQ(camera.name, "a.b");
        EXPECT_EQ(camera.picture, "folder/a.b.png");
    }

    const std::tuple<Convention, std::vector<double>> arrays[] = {
        {Convention::kOpencv, kKnownOpencv},
        {Convention::kOpengl, kKnownOpengl},
        {Convention::kBlender, kKnownBlender}};
    for (const auto& [convention, numbers] : arrays) {
        FileCamera camera =
            only(put(scratch / "p.npy", npyPoses(numbers)), {convention, kKnownSize});
        EXPECT_EQ(camera.name, "0");
        EXPECT_FALSE(camera.intrinsics);
        camera.intrinsics = kKnownLens;
        expectKnown(camera, ".npy " + std::to_string(static_cast<int>(convention)));
    }

    const std::string places[] = {
        "\"cameraToWorld\": [" + kKnownOpenglRows + "]",
        "\"cameraToWorld\": [" + kKnownOpenglRows + ", [0, 0, 0, 1]]",
        "\"worldToCamera\": [" + kKnownOpencvRows + "]",
        "\"eye\": [1, 2, 5], \"target\": [-3, 2, 5], \"up\": [0, 0, 8]",
    };
    for (const std::string& place : places) {
        expectKnown(only(put(scratch / "c.jsonl", "\n" + lineText(place) + "\r\n")), place);
    }
    const std::string with_k = R"({"size": [640, 480], "K": [[500, 0, 300.25], [0, 400, 200.5],
        [0, 0, 1]], )" + places[0] +
                               "}";
    std::string one_line = with_k;
    std::erase(one_line, '\n');
    expectKnown(only(put(scratch / "k.jsonl", one_line)), "K");
    // The file's world has +Z up, so the default up direction is +Z, which becomes +Y in the scene.
    const std::string level = lineText(R"("eye": [4, 0, 0], "target": [0, 0, 0])");
    const FileCamera upright = only(put(scratch / "u.jsonl", level), blender);
    EXPECT_EQ(glm::dvec3(upright.camera_to_world[1]), glm::dvec3(0, 1, 0));
    EXPECT_EQ(glm::dvec3(upright.camera_to_world[3]), glm::dvec3(4, 0, 0));
}

TEST(CameraFiles, ArchivesOfNumpy) {
    PEELER_REQUIRE_PYTHON("numpy");
    const ScratchDir scratch;
    const Outcome wrote = runPython(R"(
import sys, numpy
folder = sys.argv[1] + '/'
w2c = numpy.array([[0, 1, 0, -2], [0, 0, -1, 5], [-1, 0, 0, 1], [0, 0, 0, 1.0]])
flip = numpy.diag([1, -1, -1, 1.0])
c2w = numpy.linalg.inv(w2c)
gl = c2w @ flip
K = numpy.array([[500, 0, 300.25], [0, 400, 200.5], [0, 0, 1]], 'f4')
more = dict(K=K, size=numpy.array([640, 480]))
numpy.savez(folder + 'a opencv', poses=w2c[None, :3], **more)
numpy.savez_compressed(folder + 'b opengl', poses=gl.astype('f4'), **more)
numpy.savez_compressed(folder + 'c none', w2c=numpy.asfortranarray(w2c), **more)
numpy.savez(folder + 'd none', world_to_camera=w2c.astype('>f8')[:3], **more)
numpy.savez(folder + 'e none', extrinsics=numpy.asfortranarray(w2c[None].repeat(3, 0)), K=K[None].repeat(3, 0),
            size=numpy.array([[640, 480]] * 3, 'u2'))
numpy.savez(folder + 'f opencv', c2w=c2w, **more)
numpy.savez(folder + 'g opengl', camera_to_world=gl, **more)
numpy.savez(folder + 'h opengl', w2c=flip @ w2c, **more)
numpy.save(folder + 'many', numpy.concatenate([w2c[None]] * 5))
numpy.savez(folder + 'few', w2c=w2c[None].repeat(3, 0), K=K[None].repeat(2, 0))
numpy.savez(folder + 'none', K=K)
numpy.savez(folder + 'text', poses=numpy.array(['a']))
numpy.savez(folder + 'pickle', poses=numpy.array([None, 1], dtype=object))
numpy.savez(folder + 'flat', poses=w2c.ravel())
numpy.savez(folder + 'skew', w2c=w2c, K=[[500, 1, 3], [0, 400, 2], [0, 0, 1]])
w2c[0, 0] = numpy.nan
numpy.savez(folder + 'nan', w2c=w2c)
)",
                                    {scratch.path()});
    ASSERT_EQ(wrote.exit_code, 0) << wrote.err;
    int read = 0;
    for (const std::string& file : scratch.files()) {
        const std::size_t space = file.find(' ');
        if (space == std::string::npos) continue;
        CameraFileOptions options;
        const std::string convention = file.substr(space + 1, file.size() - space - 5);
        if (convention != "none") options.convention = cameraConvention(convention);
        const std::vector<FileCamera> cameras = readCameras(scratch / file, options);
        EXPECT_EQ(cameras.size(), file[0] == 'e' ? 3U : 1U);
        for (const FileCamera& camera : cameras)
            expectKnown(camera, file);
        ++read;
    }
    EXPECT_EQ(read, 8);
    EXPECT_EQ(readCameras(scratch / "many.npy", {Convention::kOpencv, {}}).size(), 5U);

    expectRefusedCameras(scratch / "few.npz", "2 entries, but there are 3 poses", "few.npz, K.npy");
    expectRefusedCameras(scratch / "none.npz", "the file has no array of poses", "none.npz");
    for (const char* name : {"text.npz", "pickle.npz"})
        expectRefusedCameras(scratch / name, "an array of numbers", "poses.npy",
                             {Convention::kOpengl, {}});
    expectRefusedCameras(scratch / "flat.npz", "shape is not (n, 3, 4)", "flat.npz, poses.npy");
    expectRefusedCameras(scratch / "skew.npz", "skew", "skew.npz, K.npy");
    expectRefusedCameras(scratch / "nan.npz", "not finite", "nan.npz, w2c.npy");
    for (const char* name : {"a opencv.npz", "g opengl.npz", "many.npy"})
        expectRefusedCameras(scratch / name, "needs a convention", name, {}, ErrorKind::kUsage);
}

TEST(CameraFiles, FieldsOfViewAndSizesOfTransforms) {
    const ScratchDir scratch;
    const std::string frame = R"("frames": [{"file_path": "train/r_0", "transform_matrix": [)" +
                              kKnownOpenglRows + "]}]}";
    // NeRF's own files give a field of view but no picture size, and their picture names have no
    // extension.
    const auto path = put(scratch / "transforms_train.json",
                          R"({"camera_angle_x": 0.6911112070083618, )" + frame);
    const FileCamera nerf = only(path, {{}, {800, 600}});
    EXPECT_EQ(nerf.name, "r_0");
    EXPECT_EQ(nerf.size, (Size{800, 600}));
    const double f = 400 / std::tan(0.6911112070083618 / 2);
    EXPECT_NEAR(nerf.intrinsics->fx, f, 1e-10);
    EXPECT_EQ(nerf.intrinsics->fy, nerf.intrinsics->fx);
    EXPECT_EQ(nerf.intrinsics->cx, 399.5);
    EXPECT_EQ(nerf.intrinsics->cy, 299.5);
    expectRefusedCameras(path, "for the picture size", "/camera_angle_x");

    // A frame's values override those of the whole file.
    const FileCamera own = only(put(
        scratch / "own.json", R"({"w": 640, "h": 480, "fl_x": 100, "cx": 320, "cy": 240, "frames": [
        {"fl_x": 50, "cx": 10.5, "camera_angle_y": 1.5707963267948966, "transform_matrix": [)" +
                                  kKnownOpenglRows + "]}]}"));
    EXPECT_EQ(own.intrinsics->fx, 50);
    EXPECT_NEAR(own.intrinsics->fy, 240, 1e-10);
    EXPECT_EQ(own.intrinsics->cx, 10);
    EXPECT_EQ(own.intrinsics->cy, 239.5);
    EXPECT_EQ(own.name, "0");

    const auto no_size = put(scratch / "s.json", R"({"fl_x": 9, "cx": 4, "cy": 3, )" + frame);
    EXPECT_EQ(only(no_size).size, (Size{0, 0}));
    EXPECT_THROW(cameraChoice(only(no_size)), Error);
    EXPECT_EQ(cameraChoice(only(no_size, {{}, {8, 6}})).size, (Size{8, 6}));
}

TEST(CameraFiles, ObjectsOfBop) {
    const ScratchDir scratch;
    // Picture 10 has no pose, so the world is its camera space. The file uses OpenCV's axes
    // for the camera and the objects.
    const auto path = put(scratch / "data/test/000001/scene_camera_left.json",
                          R"({"10": {"cam_K": [500,0,300.25,0,400,200.5,0,0,1]},
                             "2": {"cam_K": [1,0,2,0,3,4,0,0,1],
                                   "cam_R_w2c": [0,1,0,0,0,-1,-1,0,0],
                                   "cam_t_w2c": [-2000,5000,1000]}})");
    put(scratch / "data/test/000001/scene_gt_left.json",
        R"({"2": [{"obj_id": 5, "cam_R_m2c": [1,0,0,0,1,0,0,0,1], "cam_t_m2c": [3000, 2000, 10000]},
                  {"obj_id": 21, "cam_R_m2c": [0,1,0,0,0,-1,-1,0,0], "cam_t_m2c": [-2000,5000,1000]}],
            "3": [], "10": [{"obj_id": 1, "cam_R_m2c": [1,0,0,0,1,0,0,0,1],
                             "cam_t_m2c": [0,0,1]}]})");
    put(scratch / "data/camera_left.json", R"({"width": 64, "height": 48})");
    const std::vector<FileCamera> cameras = readCameras(path);
    ASSERT_EQ(cameras.size(), 2U);
    EXPECT_EQ(cameras[0].name, "000002");
    EXPECT_EQ(cameras[1].name, "000010");
    EXPECT_EQ(cameras[0].size, (Size{64, 48}));
    ASSERT_EQ(cameras[0].objects.size(), 2U);
    EXPECT_EQ(cameras[0].objects[0].id, 5);
    // The object is 10 in front of the known camera, 3 to the right and 2 down.
    EXPECT_EQ(glm::dvec3(cameras[0].objects[0].to_world[3]), glm::dvec3(-9, 5, 3));
    EXPECT_EQ(cameras[0].objects[1].to_world, glm::dmat4(1));
    EXPECT_EQ(cameras[1].camera_to_world,
              glm::dmat4({1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1}));
    EXPECT_EQ(glm::dvec3(cameras[1].objects[0].to_world[3]), glm::dvec3(0, 0, 0.001));
    // With other world axes, the objects are rotated, too.
    const auto turned = readCameras(path, {Convention::kBlender, {}});
    EXPECT_EQ(glm::dvec3(turned[0].objects[0].to_world[3]), glm::dvec3(-9, 3, -5));
    EXPECT_EQ(glm::dvec3(turned[0].camera_to_world[3]), glm::dvec3(1, 5, -2));
}

TEST(CameraFiles, ModelsOfColmap) {
    const ScratchDir scratch;
    put(scratch / "m/cameras.txt",
        "1 SIMPLE_PINHOLE 640 480 500 320 240\n2 SIMPLE_RADIAL 640 480 500 320 240 0\n"
        "4 OPENCV 640 480 500 400 320 240 0 0 0 -0.0\n");
    put(scratch / "m/images.txt",
        "8 1 0 0 0 0 0 0 4 b 1.png\r\n\r\n2 1e0 0 0 0 1 2 3 2 a.png\n\n5 -1 0 0 0 0 0 0 1 c.png");
    const std::vector<FileCamera> cameras = readCameras(scratch / "m");
    ASSERT_EQ(cameras.size(), 3U);  // the reader orders cameras by image id
    EXPECT_EQ(cameras[0].name, "a");
    EXPECT_EQ(glm::dvec3(cameras[0].camera_to_world[3]), glm::dvec3(-1, -2, -3));
    EXPECT_EQ(cameras[1].name, "c");
    EXPECT_EQ(cameras[1].intrinsics, (Intrinsics{500, 500, 319.5, 239.5}));
    EXPECT_EQ(cameras[1].camera_to_world[1], glm::dvec4(0, -1, 0, 0));
    EXPECT_EQ(cameras[2].picture, "b 1.png");
    EXPECT_EQ(cameras[2].intrinsics, (Intrinsics{500, 400, 319.5, 239.5}));
    // Binary files have priority over text files, as in COLMAP.
    put(scratch / "m/cameras.bin", colmapCamerasBinary());
    put(scratch / "m/images.bin", colmapImagesBinary());
    EXPECT_EQ(readCameras(scratch / "m").size(), 1U);
    EXPECT_EQ(readCameras(scratch / "m/images.txt").size(), 3U);
}

CameraFileOptions withLenses() {
    CameraFileOptions options;
    options.lenses = true;
    return options;
}

TEST(CameraFiles, LensesOfColmap) {
    const ScratchDir scratch;
    const std::pair<const char*, std::optional<Lens>> models[] = {
        {"SIMPLE_RADIAL 640 480 500 320 240 0.01", Lens{"simple-radial", {0.01}}},
        {"RADIAL 640 480 500 320 240 0.01 0.02", Lens{"radial", {0.01, 0.02}}},
        {"OPENCV 640 480 500 500 320 240 1 2 3 4", Lens{"opencv", {1, 2, 3, 4}}},
        {"OPENCV 640 480 500 500 320 240 0 0 0 0", {}},
        {"OPENCV_FISHEYE 640 480 500 500 320 240 0 0 0 0", Lens{"opencv-fisheye", {0, 0, 0, 0}}},
        {"FULL_OPENCV 640 480 500 500 320 240 1 2 3 4 5 6 7 8",
         Lens{"full-opencv", {1, 2, 3, 4, 5, 6, 7, 8}}},
        {"FOV 640 480 500 500 320 240 0.9", Lens{"fov", {0.9}}},
        {"SIMPLE_RADIAL_FISHEYE 640 480 500 320 240 1", Lens{"simple-radial-fisheye", {1}}},
        {"RADIAL_FISHEYE 640 480 500 320 240 1 2", Lens{"radial-fisheye", {1, 2}}},
        {"THIN_PRISM_FISHEYE 640 480 500 500 320 240 1 2 3 4 5 6 7 8",
         Lens{"thin-prism-fisheye", {1, 2, 3, 4, 5, 6, 7, 8}}},
        {"FISHEYE 640 480 500 500 320 240", Lens{"fisheye"}},
    };
    std::string cameras, images;
    int id = 0;
    for (const auto& [text, lens] : models) {
        const std::string number = std::to_string(++id);
        cameras += number + " " + text + "\n";
        images += number + " 1 0 0 0 0 0 0 " + number + " a\n\n";
    }
    put(scratch / "cameras.txt", cameras + "99 EQUIRECTANGULAR 640 320 640 320\n");
    put(scratch / "images.txt", images + "99 1 0 0 0 0 0 0 99 b\n");
    const std::vector<FileCamera> read = readCameras(scratch.path(), withLenses());
    ASSERT_EQ(read.size(), std::size(models) + 1);
    for (std::size_t i = 0; i < std::size(models); ++i) {
        EXPECT_EQ(read[i].lens, models[i].second) << models[i].first;
        EXPECT_EQ(read[i].intrinsics, (Intrinsics{500, 500, 319.5, 239.5})) << models[i].first;
    }
    EXPECT_EQ(read.back().lens, Lens{"equirectangular"});
    EXPECT_FALSE(read.back().intrinsics);
    // The binary reader takes the same models.
    put(scratch / "b/cameras.bin", PackedNumbers()
                                       .add(std::uint64_t{1})
                                       .add(std::uint32_t{3})
                                       .add(std::int32_t{7})
                                       .add(std::uint64_t{640})
                                       .add(std::uint64_t{480})
                                       .add(std::vector<double>{500, 400, 300.75, 201, 0.9})
                                       .text);
    put(scratch / "b/images.bin", colmapImagesBinary());
    EXPECT_EQ(readCameras(scratch / "b", withLenses())[0].lens, (Lens{"fov", {0.9}}));
    expectRefusedCameras(scratch / "b", "distortion", "cameras.bin");
}

TEST(CameraFiles, LensesOfTransforms) {
    const ScratchDir scratch;
    const std::pair<const char*, std::optional<Lens>> models[] = {
        {R"("camera_model": "OPENCV", "k1": 0, "p2": 0)", {}},
        {R"("k1": 1, "k2": 2, "p1": 3, "p2": 4)", Lens{"opencv", {1, 2, 3, 4, 0}}},
        {R"("k1": 1, "k3": 5)", Lens{"opencv", {1, 0, 0, 0, 5}}},
        {R"("distortion_params": [1, 2, 5, 0, 3, 4])", Lens{"opencv", {1, 2, 3, 4, 5}}},
        {R"("camera_model": "FULL_OPENCV", "k1": 1, "k4": 4, "k6": 6, "p1": 7)",
         Lens{"full-opencv", {1, 0, 7, 0, 0, 4, 0, 6}}},
        {R"("camera_model": "OPENCV_FISHEYE", "k1": 1, "k4": 4)",
         Lens{"opencv-fisheye", {1, 0, 0, 4}}},
        {R"("is_fisheye": true)", Lens{"opencv-fisheye", {0, 0, 0, 0}}},
        {R"("is_fisheye": true, "k3": 3, "p1": 5)",
         Lens{"thin-prism-fisheye", {0, 0, 5, 0, 3, 0, 0, 0}}},
        {R"("camera_model": "FISHEYE624", "distortion_params": [1,2,3,4,5,6,7,8,9,10,11,12])",
         Lens{"rad-tan-thin-prism-fisheye", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}}},
        {R"("ftheta_p0": 0, "ftheta_p1": 0.01, "ftheta_p3": 1e-9)",
         Lens{"ftheta", {0, 0.01, 0, 1e-9, 0}}},
        {R"("latlong": true, "fl_x": 320, "fl_y": 480, "cx": 320, "cy": 240)",
         Lens{"equirectangular"}},
        {R"("camera_model": "EQUIRECTANGULAR", "fl_x": 320, "fl_y": 480, "cx": 320, "cy": 240)",
         Lens{"equirectangular"}},
    };
    for (const auto& [text, lens] : models) {
        const std::string intrinsics = std::string(text).find("fl_x") == std::string::npos
                                           ? R"("fl_x": 500, "cx": 300.75, )"
                                           : "";
        const std::string frames =
            R"("w": 640, "h": 480, "frames": [{"transform_matrix": [)" + kKnownOpenglRows + "]}]";
        const auto path = put(scratch / "t.json", "{" + intrinsics + frames + ", " + text + "}");
        const FileCamera camera = readCameras(path, withLenses())[0];
        EXPECT_EQ(camera.lens, lens) << text;
        const bool in_pixels = lens && lens->model == "ftheta";
        if (lens != Lens{"equirectangular"}) {
            EXPECT_EQ(camera.intrinsics, in_pixels ? (Intrinsics{1, 1, 300.25, 239.5})
                                                   : (Intrinsics{500, 500, 300.25, 239.5}));
        }
        if (lens) expectRefusedCameras(path, "rendered", "t.json");
        // The frame's own values go before those of the file.
        if (!lens) continue;
        const auto framed = put(scratch / "f.json",
                                "{" + intrinsics + R"("w": 640, "h": 480, "frames": [{)" + text +
                                    R"(, "transform_matrix": [)" + kKnownOpenglRows + "]}]}");
        EXPECT_EQ(readCameras(framed, withLenses())[0].lens, lens) << text;
    }
    const std::tuple<const char*, const char*, const char*> wrong[] = {
        {R"("equirectangular": true)", "only pinhole", "/equirectangular"},
        {R"("camera_model": "VR180_L")", "VR180_L", "/camera_model"},
        {R"("k1": 1, "k4": 1)", "r^8", "/k1"},
        {R"("s1": 1)", "distortion", "/s1"},
        {R"("ftheta_p0": 1)", "0 at the centre", "/ftheta_p0"},
        {R"("camera_model": "FISHEYE624", "distortion_params": [1])", "list of 12",
         "/distortion_params"},
    };
    for (const auto& [text, what, where] : wrong)
        expectRefusedCameras(
            put(scratch / "t.json", std::string("{") + text +
                                        R"(, "w": 640, "h": 480, "fl_x": 500, "frames": [
                                     {"transform_matrix": [)" +
                                        kKnownOpenglRows + "]}]}"),
            what, where, withLenses());
}

TEST(CameraFiles, LensesOfLines) {
    const ScratchDir scratch;
    const std::string place = R"("eye": [0, 0, 1], "target": [0, 0, 0]})";
    const std::string rest =
        R"("size": [64, 32], "fx": 50, "fy": 50, "cx": 32, "cy": 16, )" + place;
    const auto path = put(scratch / "c.jsonl",
                          R"({"lens": "opencv-fisheye", "distortion": [1, 2, 3, 4], )" + rest +
                              "\n" + R"({"distortion": [0, 0, 0, 0], )" + rest + "\n" +
                              R"({"lens": "equirectangular", "size": [64, 32], )" + place);
    const auto cameras = readCameras(path, withLenses());
    EXPECT_EQ(cameras[0].lens, (Lens{"opencv-fisheye", {1, 2, 3, 4}}));
    EXPECT_FALSE(cameras[1].lens);
    EXPECT_EQ(cameras[2].lens, Lens{"equirectangular"});
    EXPECT_EQ(cameraChoice(cameras[0]).lens, cameras[0].lens);
    EXPECT_TRUE(viewOfCamera(cameras[0]).rays);
    expectRefusedCameras(path, "lens distortion is not rendered", "c.jsonl:1, /lens");
}

TEST(CameraFiles, QuaternionsOfColmapHaveAnyLength) {
    const ScratchDir scratch;
    put(scratch / "cameras.txt", colmapCamerasText());
    put(scratch / "images.txt",
        "1 0.5 0.5 0.5 -0.5 -2 5 1 3 a\n\n2 4 4 4 -4 -2 5 1 3 b\n\n"
        "3 -1e-3 -1e-3 -1e-3 1e-3 -2 5 1 3 c\n\n4 0.501 0.501 0.501 -0.501 -2 5 1 3 d\n");
    const std::vector<FileCamera> cameras = readCameras(scratch.path());
    ASSERT_EQ(cameras.size(), 4U);
    for (const FileCamera& camera : cameras)
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 4; ++row)
                EXPECT_NEAR(camera.camera_to_world[column][row], knownPose()[column][row], 1e-12);
}

TEST(CameraFiles, FieldsOfViewOfTransformsAreRadiansOrDegrees) {
    const ScratchDir scratch;
    const std::string rest = R"("w": 640, "h": 480, "frames": [{"transform_matrix": [)" +
                             kKnownOpenglRows + R"(,[0,0,0,1]]}]})";
    for (const std::string angle : {R"({"camera_angle_x": 1.5707963267948966, )",
                                    R"({"x_fov": 90, )", R"({"y_fov": 73.7397952917019, )"}) {
        const auto cameras = readCameras(put(scratch / "t.json", angle + rest));
        EXPECT_NEAR(cameras[0].intrinsics->fx, 320, 1e-9) << angle;
        EXPECT_NEAR(cameras[0].intrinsics->fy, 320, 1e-9) << angle;
    }
}

TEST(CameraFiles, ObjectsOfBopAreFoundByTheNumberOfTheirPicture) {
    const ScratchDir scratch;
    const auto path = put(scratch / "scene_camera.json", bopText());
    put(scratch / "scene_gt.json",
        R"({"000007": [{"obj_id": 5, "cam_R_m2c": [1,0,0,0,1,0,0,0,1], "cam_t_m2c": [0, 0, 1]}]})");
    EXPECT_EQ(readCameras(path)[0].objects.size(), 1U);
}

TEST(CameraFiles, LinesOfOurOwn) {
    const ScratchDir scratch;
    const std::string eye = R"("eye": [0, 4, 0], "target": [0, 0, 0]})";
    const auto path =
        put(scratch / "c.jsonl", R"({"fov": 40.5, "near": 0.25, "far": 8, )" + eye + "\n\n" +
                                     R"({"orthoHeight": 3, "near": 0, )" + eye);
    const std::vector<FileCamera> cameras = readCameras(path);
    ASSERT_EQ(cameras.size(), 2U);
    EXPECT_EQ(cameras[0].fov, 40.5);
    EXPECT_EQ(cameras[0].near, 0.25);
    EXPECT_EQ(cameras[0].far, 8);
    EXPECT_EQ(cameras[0].size, (Size{0, 0}));
    EXPECT_EQ(cameras[0].name, "0");
    EXPECT_EQ(cameras[1].ortho_height, 3);
    // The camera looks straight down, so north (−Z) is up, as for all cameras given by eye and
    // target.
    EXPECT_EQ(glm::dvec3(cameras[0].camera_to_world[1]), glm::dvec3(0, 0, -1));
    CameraChoice asked;
    asked.size = {64, 48};
    const CameraChoice choice = cameraChoice(cameras[1], asked);
    EXPECT_EQ(choice.size, (Size{64, 48}));
    EXPECT_EQ(choice.ortho_height, 3);
    checkCamera(choice);
}

TEST(CameraFiles, PosesThatAreNearlyRigidAreTaken) {
    const ScratchDir scratch;
    const std::string nearly = "[0,0,1,1],[1.00002,0,0,2],[0.00001,1,0,5]";
    const FileCamera camera = only(put(scratch / "t.json", transformsText(nearly)));
    const View view = viewOfCamera(camera);
    EXPECT_LT(distanceFromRigid(view.camera_to_world), 1e-15);
    EXPECT_NEAR(glm::length(view.camera_to_world[0] - knownPose()[0]), 0, 2e-5);
    // The reader makes the axes, which are the rows of a world-to-camera matrix, orthonormal. This
    // correction must not move the eye.
    const FileCamera inverse =
        only(put(scratch / "w.jsonl",
                 lineText("\"worldToCamera\": [[0,1.00002,0,-2],[0,0,-1,5],[-1,0,0,1]]")));
    EXPECT_NEAR(glm::length(inverse.camera_to_world[3] - knownPose()[3]), 0, 1e-12);
}

}  // namespace
}  // namespace peeler::test
