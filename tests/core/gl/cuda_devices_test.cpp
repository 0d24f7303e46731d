// SPDX-License-Identifier: Apache-2.0
// Tests that CUDA_VISIBLE_DEVICES is interpreted as in the CUDA Programming Guide.
#include "core/gl/cuda_devices.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include <peeler/error.h>
#include "core/gl/context.h"

namespace peeler::gl {
namespace {

using Positions = std::vector<std::size_t>;

/// Returns GPUs in an order that EGL may use, but CUDA does not.
const std::vector<CudaDevice>& gpus() {
    static const std::vector<CudaDevice> list = {
        {2, "8932f937-d72c-4106-c12f-20bd9faed9f6"},
        {0, "8932aaaa-0000-0000-0000-000000000000"},
        {1, "0a0b0c0d-0000-0000-0000-000000000001"},
    };
    return list;
}

TEST(CudaDevices, AllAreVisibleByTheirOrdinalsWithoutTheVariable) {
    EXPECT_EQ(visibleCudaDevices(std::nullopt, gpus()), (Positions{1, 2, 0}));
    EXPECT_EQ(visibleCudaDevices(std::nullopt, {}), Positions{});
}

TEST(CudaDevices, TheVariableChoosesAndOrders) {
    const struct {
        const char* value;
        Positions visible;
    } cases[] = {
        {"", {}},
        {"-1", {}},
        {"NoDevFiles", {}},
        {"2", {0}},
        {"2,1", {0, 2}},
        {" 1 , 0 ", {2, 1}},
        {"0,2,-1,1", {1, 0}},  // example of the CUDA guide: entries after −1 are ignored
        {"0,7,1", {1}},
        {"0,,1", {1}},
        {"0,0", {}},  // a duplicate empties the list
        {"GPU-8932f937-d72c-4106-c12f-20bd9faed9f6", {0}},
        {"GPU-8932f,GPU-0A0B", {0, 2}},
        {"GPU-8932", {}},  // the prefix is ambiguous
        {"GPU-", {}},
        {"8932f937", {}},  // the prefix "GPU-" is required
        {"GPU-0a0b,GPU-ffff,GPU-8932a", {2}},
        {"MIG-GPU-8932f937-d72c-4106-c12f-20bd9faed9f6/1/0", {0}},
        {"MIG-41b35014-cc5e-5a5d-a9a0-0e3ee3a4a1e5", {}},
    };
    for (const auto& row : cases)
        EXPECT_EQ(visibleCudaDevices(row.value, gpus()), row.visible) << row.value;
}

TEST(CudaDevices, WithoutUuidsOnlyNumbersNameThem) {
    EXPECT_EQ(visibleCudaDevices("1,GPU-8932", {{0, ""}, {1, ""}}), Positions{1});
}

/// The driver has read the value "2,0", so its ordinals count only the visible devices.
TEST(CudaDevices, ADriverThatReadsTheVariableHasNumberedWhatIsVisible) {
    std::vector<CudaDevice> numbered = gpus();
    numbered[0].ordinal = 0;
    numbered[1].ordinal = 1;
    numbered[2].ordinal = std::nullopt;
    EXPECT_EQ(visibleCudaDevices("2,0", numbered), (Positions{0, 1}));
    EXPECT_EQ(visibleCudaDevices(std::nullopt, numbered), (Positions{0, 1}));
}

/// The host's environment is read but never changed. An explicit choice by the host has priority.
TEST(CudaDevices, TheVariableStaysInTheEnvironment) {
    constexpr const char* kName = "CUDA_VISIBLE_DEVICES";
    const char* const before = std::getenv(kName);
    const std::optional<std::string> kept =
        before ? std::optional<std::string>(before) : std::nullopt;
    unsetenv(kName);
    EXPECT_EQ(cudaVisibleDevices(), std::nullopt);
    setenv(kName, "1", 1);
    EXPECT_EQ(cudaVisibleDevices(), "1");
    listDevices();
    ASSERT_NE(std::getenv(kName), nullptr);
    EXPECT_STREQ(std::getenv(kName), "1");
    setenv(kName, "0", 1);
    EXPECT_EQ(cudaVisibleDevices(), "0") << "nothing was kept";
    if (kept)
        setenv(kName, kept->c_str(), 1);
    else
        unsetenv(kName);
}

TEST(DeviceChoice, IsANumberOrHasAWordBeforeIt) {
    Device device;
    device.index = 3;
    device.cuda = 1;
    device.uuid = "8932f937-d72c-4106-c12f-20bd9faed9f6";
    for (const char* text : {"3", "cuda:1", "uuid:8932f937", "uuid:GPU-8932F937-D72C", "uuid:8"})
        EXPECT_TRUE(parseDeviceChoice(text).matches(device)) << text;
    for (const char* text : {"2", "cuda:0", "uuid:8932e", "uuid:f937"})
        EXPECT_FALSE(parseDeviceChoice(text).matches(device)) << text;
    EXPECT_FALSE(parseDeviceChoice("cuda:0").matches(Device{})) << "no CUDA, no number";
    EXPECT_FALSE(parseDeviceChoice("uuid:0").matches(Device{}));
    EXPECT_TRUE(DeviceChoice{}.matches(device));
    for (const char* text : {"", "-1", "1x", "cuda:", "cuda:-1", "cuda:x", "uuid:", "uuid:GPU-",
                             "uuid:xyz", "gpu:0", "99999"})
        EXPECT_THROW(parseDeviceChoice(text), Error) << text;
}

TEST(DeviceChoice, UuidsAreWrittenAsOthersWriteThem) {
    const unsigned char bytes[16] = {0x89, 0x32, 0xf9, 0x37, 0xd7, 0x2c, 0x41, 0x06,
                                     0xc1, 0x2f, 0x20, 0xbd, 0x9f, 0xae, 0xd9, 0xf6};
    EXPECT_EQ(uuidText(bytes), "8932f937-d72c-4106-c12f-20bd9faed9f6");
}

}  // namespace
}  // namespace peeler::gl
