// SPDX-License-Identifier: Apache-2.0
// Tests that a sink behind a background thread receives the same calls, and that the caller
// receives the sink's exceptions.
#include "core/image/background_sink.h"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace peeler {
namespace {

struct Log {
    std::vector<std::string> calls;
    std::vector<float> depths;
    std::vector<const float*> storage;
    std::thread::id writer;
    std::promise<void> hold;  ///< if `holds`, finish() waits for this promise
    bool holds = false;
    int fails_at = -1;  ///< index of the band whose write fails; −1 = none
};

class LoggingSink final : public Sink {
  public:
    explicit LoggingSink(Log& log) : log_(log) {}
    ~LoggingSink() override { log_.calls.emplace_back("end"); }
    void begin(const Plan&) override { log_.calls.emplace_back("begin"); }
    void write(LayeredImage&& band) override {
        if (log_.fails_at == static_cast<int>(log_.depths.size()))
            throw std::runtime_error("disk full");
        log_.writer = std::this_thread::get_id();
        log_.calls.emplace_back("write");
        log_.depths.push_back(band.z.front());
        log_.storage.push_back(band.z.data());
    }
    void finish() override {
        if (log_.holds) log_.hold.get_future().wait();
        log_.calls.emplace_back("finish");
    }
    SinkMemory memory(const Plan&) const override { return {.rows = 3, .bytes = 7}; }

  private:
    Log& log_;
};

LayeredImage onePixelBand(float z) {
    LayeredImage image;
    image.window = {0, 0, 1, 1};
    image.offsets = {0, 1};
    image.z = {z};
    return image;
}

TEST(BackgroundSink, HandsEverythingOnInOrder) {
    Log log;
    {
        BackgroundSink sink(std::make_unique<LoggingSink>(log));
        sink.begin({});
        EXPECT_EQ(sink.memory({}).rows, 3);
        EXPECT_EQ(sink.memory({}).bands, 1);
        LayeredImage image;
        for (const float z : {1.0F, 2.0F, 3.0F}) {
            image = onePixelBand(z);
            sink.write(std::move(image));
            // write() leaves the storage of the previous band in `image`.
            if (!image.z.empty()) image.z.front() = -1;
        }
        sink.finish();
        sink.wait();
    }
    EXPECT_EQ(log.calls,
              (std::vector<std::string>{"begin", "write", "write", "write", "finish", "end"}));
    EXPECT_EQ(log.depths, (std::vector<float>{1, 2, 3}));
    EXPECT_NE(log.writer, std::this_thread::get_id());
}

TEST(BackgroundSink, TakesBandsAndGivesStorageBackWithoutCopies) {
    Log log;
    BackgroundSink sink(std::make_unique<LoggingSink>(log));
    sink.begin({});
    LayeredImage image = onePixelBand(1);
    const float* const first = image.z.data();
    sink.write(std::move(image));
    image = onePixelBand(2);
    const float* const second = image.z.data();
    sink.write(std::move(image));
    EXPECT_EQ(image.z.data(), first);
    sink.wait();
    EXPECT_EQ(log.storage, (std::vector<const float*>{first, second}));
}

TEST(BackgroundSink, FinishDoesNotWait) {
    Log log;
    log.holds = true;
    BackgroundSink sink(std::make_unique<LoggingSink>(log));
    sink.begin({});
    sink.write(onePixelBand(1));
    sink.finish();  // if finish() waited, the test would deadlock here
    log.hold.set_value();
    sink.wait();
    EXPECT_EQ(log.calls.back(), "finish");
}

TEST(BackgroundSink, FailuresComeBack) {
    Log log;
    log.fails_at = 1;
    BackgroundSink sink(std::make_unique<LoggingSink>(log));
    sink.begin({});
    sink.write(onePixelBand(1));
    sink.write(onePixelBand(2));
    EXPECT_THROW(sink.write(onePixelBand(3)), std::runtime_error);
    EXPECT_EQ(log.depths.size(), 1U);
}

TEST(BackgroundSink, TheLastBandsFailureIsNotLost) {
    Log log;
    log.fails_at = 0;
    BackgroundSink sink(std::make_unique<LoggingSink>(log));
    sink.begin({});
    sink.write(onePixelBand(1));
    EXPECT_THROW(
        {
            sink.finish();
            sink.wait();
        },
        std::runtime_error);
}

TEST(BackgroundSink, WhatIsNotFinishedIsGivenUp) {
    Log log;
    {
        BackgroundSink sink(std::make_unique<LoggingSink>(log));
        sink.begin({});
        sink.write(onePixelBand(1));
    }
    EXPECT_EQ(log.calls.back(), "end");
    for (const std::string& call : log.calls)
        EXPECT_NE(call, "finish");
}

}  // namespace
}  // namespace peeler
