// SPDX-License-Identifier: Apache-2.0
// Tests the opening of files: regular files are read, all other kinds are rejected at once.
#include "formats/file/regular_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <functional>
#include <optional>
#include <thread>

#include <peeler/error.h>
#include "formats/exr/exr_input.h"
#include "formats/file/file_name.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/image/environment_file.h"
#include "formats/image/flat_image.h"
#include "formats/image/image_library.h"
#include "formats/output_hash.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

std::string messageOf(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_FALSE(error.hint().empty()) << error.what();
        return error.what();
    }
    return "";
}

TEST(RegularFile, IsReadInPartsAndAtOnce) {
    const ScratchDir scratch;
    writeFile(scratch / "a", "0123456789");
    EXPECT_EQ(readRegularText(scratch / "a"), "0123456789");
    EXPECT_EQ(readRegularFile(scratch / "a", 10).size(), 10U);
    EXPECT_EQ(messageOf([&] { readRegularFile(scratch / "a", 9); }),
              "the file has 10 bytes, but the limit is 9");
    const RegularFile file(scratch / "a");
    ASSERT_TRUE(file.isOpen());
    char four[4] = {};
    EXPECT_TRUE(file.read(3, four));
    EXPECT_EQ(std::string(four, 4), "3456");
    EXPECT_FALSE(file.read(7, four));
    EXPECT_EQ(file.readSome(7, four), 3U);
    EXPECT_EQ(file.readSome(20, four), 0U);
}

/// Calls every function that opens files, with paths that are not regular files. No call may block,
/// and each must report the fault.
TEST(RegularFile, PipesDevicesAndFoldersAreRefused) {
    const ScratchDir scratch;
    ASSERT_EQ(mkfifo((scratch / "pipe").c_str(), 0600), 0);
    const int server = socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string socket_name = (scratch / "s").string();
    ASSERT_LT(socket_name.size(), sizeof address.sun_path);
    std::memcpy(address.sun_path, socket_name.c_str(), socket_name.size());
    ASSERT_EQ(bind(server, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    fs::create_symlink("pipe", scratch / "link");
    const std::pair<std::string, std::string> places[] = {
        {(scratch / "pipe").string(), "not a regular file"},
        {(scratch / "link").string(), "not a regular file"},
        {socket_name, "not a regular file"},
        {"/dev/zero", "not a regular file"},
        {"/dev/tty", "not a regular file"},
        {scratch.path().string(), "this is a folder"},
        {(scratch / "missing").string(), "does not exist"},
    };
    for (const auto& [path, words] : places) {
        if (path == "/dev/tty" && !RegularFile(path).isOpen() &&
            messageOf([&] { readRegularText(path); }).find(words) == std::string::npos)
            continue;  // without a terminal, /dev/tty cannot even be opened
        const std::function<void()> ways[] = {
            [&] { readRegularText(path); },
            [&] { fileKind(path); },
            [&] { ExrInput{path}; },
            [&] { readFlatImage(path); },
            [&] { readGltf(path); },
            [&] {
                ReadWarnings warnings(false, path);
                readEnvironment(path, warnings);
            },
            [&] { imageDecoder("tiff", path); },
            [&] { imageDecoder("png", path); },
        };
        for (const auto& way : ways)
            EXPECT_NE(messageOf(way).find(words), std::string::npos)
                << path << " " << &way - ways << ": " << messageOf(way);
        EXPECT_EQ(outputHashOf(path), "") << path;
        EXPECT_FALSE(RegularFile(path).isOpen());
    }
    close(server);
}

/// Returns the kind of the Error that an action throws, if any. Expects the Error to have a reason,
/// a place and a hint.
std::optional<ErrorKind> kindOf(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("cannot examine the path"), std::string::npos);
        EXPECT_NE(error.where(), "");
        EXPECT_NE(error.hint(), "");
        return error.kind();
    }
    return std::nullopt;
}

TEST(RegularFile, IsThereOrNotWhereThatCanBeTold) {
    const ScratchDir scratch;
    writeFile(scratch / "a", "text");
    fs::create_symlink("a", scratch / "link");
    fs::create_symlink("nowhere", scratch / "dangling");
    for (const char* name : {"a", "link", "."}) {
        EXPECT_TRUE(fileExists(scratch / name)) << name;
        EXPECT_TRUE(isTaken(scratch / name)) << name;
        EXPECT_TRUE(isSeen(scratch / name)) << name;
    }
    for (const fs::path& name : {fs::path("b"), "a" / fs::path("b"), "b" / fs::path("b"),
                                 fs::path(std::string(256, 'n'))}) {
        EXPECT_FALSE(fileExists(scratch / name)) << name;
        EXPECT_FALSE(isTaken(scratch / name)) << name;
        EXPECT_FALSE(isSeen(scratch / name)) << name;
    }
    EXPECT_FALSE(fileExists(scratch / "dangling"));
    EXPECT_TRUE(isTaken(scratch / "dangling")) << "a file would replace it";
    EXPECT_EQ(namesIn(scratch.path()).size(), 3U);
    EXPECT_TRUE(namesIn(scratch / "b").empty());
    EXPECT_TRUE(namesIn(scratch / "a").empty());
}

TEST(RegularFile, WhatCannotBeToldIsNeitherThereNorNot) {
    const ScratchDir scratch;
    const fs::path loop = scratch / "loop", below = loop / "a";
    fs::create_symlink("loop", loop);
    EXPECT_EQ(kindOf([&] { fileExists(below); }), ErrorKind::kInput);
    EXPECT_EQ(kindOf([&] { fileExists(loop, ErrorKind::kOutput); }), ErrorKind::kOutput);
    EXPECT_EQ(kindOf([&] { isTaken(below); }), ErrorKind::kOutput);
    EXPECT_TRUE(isTaken(loop));
    EXPECT_FALSE(isSeen(below));
    EXPECT_EQ(kindOf([&] { namesIn(loop); }), ErrorKind::kOutput);
    EXPECT_EQ(kindOf([&] { framesThere(below); }), ErrorKind::kOutput);
    EXPECT_EQ(kindOf([&] { framesThere(loop / "a.####.exr"); }), ErrorKind::kOutput);
}

TEST(RegularFile, WaitsForALease) {
    const ScratchDir scratch;
    writeFile(scratch / "a", "text");
    const int file = open((scratch / "a").c_str(), O_RDWR | O_CLOEXEC);
    const auto action = std::signal(SIGIO, SIG_IGN);
    if (fcntl(file, F_SETLEASE, F_WRLCK) != 0) {
        close(file);
        GTEST_SKIP() << "no leases in this file system: " << std::strerror(errno);
    }
    std::thread giver([&] {
        while (fcntl(file, F_GETLEASE) == F_WRLCK)
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        fcntl(file, F_SETLEASE, F_UNLCK);
    });
    EXPECT_EQ(readRegularText(scratch / "a"), "text");
    giver.join();
    close(file);
    std::signal(SIGIO, action);
}

}  // namespace
}  // namespace peeler::test
