// SPDX-License-Identifier: Apache-2.0
// Seeds for jobs of peeler batch, and for values on the command line.
#include "formats/exr/exr_files.h"
#include "fuzz/seeds.h"

namespace peeler::fuzz {
namespace {

constexpr const char* kBatches[] = {
    R"({"verb": "render", "args": ["a.glb", "-o", "a.exr"], "options": {"size": "64x36", "crop": "1,2,30,20", "method": "dual", "channels": "normal,id", "shadows": true}}
{"id": "b", "verb": "rays", "args": ["b.glb", "-o", "b.npz", "--threads", "1"], "options": {"direction": ["0,0,1", "-1,0,0"], "resolution": 32, "double": true, "quiet": false}}

)",
    R"({"verb": "render", "args": ["a.glb", "-o", "####.exr"], "options": {"frames": "1-10x2,30", "chunk": "1/2", "eye": "1,2,3", "target": "0,0,0", "fov": 30}}
)",
    R"({"verb": "render", "args": ["a.glb", "-o", "t-{chunk}.tar", "--chunk", "2/25", "--views", "5"]})",
    R"({"verb": "extract", "args": ["a.exr", "--points", "a.ply", "--npz", "a.npz"]}
{"verb": "merge", "args": ["t.1.exr", "t.2.exr", "-o", "whole.exr"]}
{"verb": "convert", "args": ["d.exr", "-o", "l.exr", "--as", "ldi", "--compression", "zips"]}
{"verb": "bake", "args": ["a.glb", "-o", "b.glb", "--directions", "8"], "options": {"memory": "1G"}}
)",
    R"({"job":1,"id":"front","verb":"render","hash":"0123456789abcdef","exitCode":0,"milliseconds":812,"warnings":[],"result":{"file":"a.exr"}}
{"job":2,"verb":"render","hash":"0123456789abcde0","exitCode":3,"milliseconds":8,"warnings":["w"],"error":{"what":"no","hint":"try"}}
)"};

/// A text, and its grammar's index in the target's table.
struct Value {
    char grammar;
    const char* text;
};
constexpr Value kValues[] = {
    {0, "--eye 1,2,3 --target 0,0,0 --up 0,0,1 --fov 40 --near 0.1 --far inf --size 64x36"},
    {0, "--camera 0 --size 640 --crop 1,2,30,20 --tile 2/7"},
    {0, "--ortho-height 3.5 --near 1 --far 9 --size 100x50"},
    {1, "1-100x2,150,200-180,-5-5,7:3"},
    {1, "-3--1"},
    {3, "pic_####.exr"},
    {3, "pic_%04d_@@@@%%.exr"},
    {4, "2/25 train-{chunk}.tar"},
    {5, "-1.5e3"},
    {6, "inf"},
    {7, "123456"},
    {8, "1,2"},
    {9, "0.5,-2,3e-3,4"},
    {10, "1,2,3,4,5,6"},
    {11, "0,1,0"},
    {12, "179.9"},
    {13, "1920x1080"},
    {14, "1,2,30,40"},
    {15, "1.5GiB"},
    {16, "#ff8000cc"},
    {16, "0.5,1,0,0.25"},
    {17, "all"},
};

constexpr const char* kWorkerLines[] = {
    R"({"id":7,"verb":"render","args":["s.glb","-o","o.exr"],"options":{"size":"64x48"},"progress":true})",
    R"({"id":"a","verb":"rays","args":["s.glb"],"options":{"output":"o.npz","direction":["0,0,1","1,0,0"]}})",
    "{\"id\":1,\"verb\":\"info\",\"args\":[\"s.glb\"]}\n{\"cancel\":1}\n",
};

}  // namespace

void addTextSeeds(Seeds& seeds) {
    for (const char* text : kBatches)
        seeds["batch"].push_back(seedOf(text));
    for (const char* text : kWorkerLines)
        seeds["worker"].push_back(seedOf(text));
    for (const Value& value : kValues)
        seeds["grammar"].push_back(seedOf(value.grammar + std::string(value.text)));
    View view;
    view.crop = {1, 2, 30, 40};
    view.camera_name = "eye";
    seeds["grammar"].push_back(seedOf('\2' + cameraJson(view)));
    view.projection = {false, 1.5, 0.75, 0.125, 8};
    view.sample = {0.25, 0.75};
    seeds["grammar"].push_back(seedOf('\2' + cameraJson(view)));
}

}  // namespace peeler::fuzz
