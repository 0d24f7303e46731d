// SPDX-License-Identifier: Apache-2.0
// Tests that a session keeps scenes open while their files are unchanged, within its memory limit.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "cmd/session/session.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class Messages final : public cmd::Reporter {
  public:
    void failure(const Error&) override {}
    void result(const cmd::Json&) override {}
    void text(std::string_view) override {}

    std::vector<Text> warnings;

  private:
    void message(cmd::Severity severity, const Text& text) override {
        if (severity == cmd::Severity::kWarning) warnings.emplace_back(text);
    }
};

/// Sets a file's modification time to the past, so that the next change is detected.
void settle(const fs::path& path) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::seconds(1));
}

void writeTriangle(const fs::path& path, float size) {
    std::ofstream(path) << "v 0 0 0\nv " << size << " 0 0\nv 0 " << size << " 0\nf 1 2 3\n";
    settle(path);
}

class SessionTest : public ::testing::Test {
  protected:
    SessionTest() { writeTriangle(scene_, 1); }

    cmd::SceneRequest request() const {
        cmd::SceneRequest request;
        request.scene.file = scene_;
        return request;
    }
    static gl::ContextRequest device() {
        gl::ContextRequest device;
        device.backend = testBackend();
        return device;
    }

    ScratchDir folder_;
    fs::path scene_ = folder_ / "part.obj";
    Messages messages_;
};

TEST_F(SessionTest, OpensAgainWhatHasNotChanged) {
    cmd::Session session(messages_, std::uint64_t{1} << 30);
    const cmd::SharedScene first = session.open(request());
    EXPECT_EQ(session.open(request()), first);

    cmd::SceneRequest other = request();
    other.scene.normalize = Normalized::kUnitCube;
    EXPECT_NE(session.open(other), first);
    other = request();
    other.appearance.studio = true;
    EXPECT_NE(session.open(other), first);
    EXPECT_EQ(session.open(request()), first);

    writeTriangle(scene_, 2);
    const cmd::SharedScene changed = session.open(request());
    EXPECT_NE(changed, first);
    EXPECT_EQ(changed->at(0).bounds()->max.x, 2);
}

TEST_F(SessionTest, ReadsAgainWhereAMissingFileAppears) {
    std::ofstream(scene_) << "mtllib paint.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    settle(scene_);
    // The reader warns of a missing file, so the session watches the folder, too.
    settle(folder_.path());
    cmd::Session session(messages_, std::uint64_t{1} << 30);
    const cmd::SharedScene first = session.open(request());
    ASSERT_FALSE(messages_.warnings.empty());
    EXPECT_EQ(session.open(request()), first);
    // open() repeats the warnings of a scene that is already open.
    EXPECT_EQ(messages_.warnings.size() % 2, 0U);
    std::ofstream(folder_ / "paint.mtl") << "newmtl red\nKd 1 0 0\n";
    messages_.warnings.clear();
    EXPECT_NE(session.open(request()), first);
    EXPECT_TRUE(messages_.warnings.empty());
}

TEST_F(SessionTest, ReadsAgainWhatWasWrittenJustBefore) {
    cmd::Session session(messages_, std::uint64_t{1} << 30);
    fs::last_write_time(scene_, fs::file_time_type::clock::now());
    const cmd::SharedScene first = session.open(request());
    EXPECT_NE(session.open(request()), first);
}

TEST_F(SessionTest, KeepsNothingUnlessItMay) {
    cmd::Session session(messages_);
    const cmd::SharedScene first = session.open(request());
    EXPECT_NE(session.open(request()), first);
    session.renderer(device(), first, first->at(0));
    EXPECT_TRUE(session.hasContext());
    session.release();
    EXPECT_FALSE(session.hasContext());
}

TEST_F(SessionTest, KeepsContextsAndWhatIsUploaded) {
    cmd::Session session(messages_, std::uint64_t{1} << 30);
    const cmd::SharedScene scene = session.open(request());
    GlRenderer& renderer = session.renderer(device(), scene, scene->at(0));
    gl::Context& context = session.context(device());
    session.release();
    EXPECT_EQ(&session.context(device()), &context);
    EXPECT_EQ(&session.renderer(device(), scene, scene->at(0)), &renderer);
    session.close();
    EXPECT_FALSE(session.hasContext());
    EXPECT_TRUE(session.forget());
    EXPECT_FALSE(session.forget());
}

TEST_F(SessionTest, ForgetsWhatWasUsedLongestAgo) {
    cmd::Session session(messages_, 1);  // a limit of one byte, which keeps only scenes in use
    const fs::path second = folder_ / "second.obj";
    writeTriangle(second, 3);
    cmd::SceneRequest other = request();
    other.scene.file = second;
    std::weak_ptr<const cmd::OpenedScene> first;
    {
        const cmd::SharedScene scene = session.open(request());
        session.renderer(device(), scene, scene->at(0));
        first = scene;
    }
    const cmd::SharedScene scene = session.open(other);
    session.renderer(device(), scene, scene->at(0));
    // A small scene may add no resident memory and is then kept; forget() removes it, too.
    session.forget();
    EXPECT_TRUE(first.expired());
}

}  // namespace
}  // namespace peeler::test
