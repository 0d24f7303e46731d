# SPDX-License-Identifier: Apache-2.0
# Cross-builds for arm64 on Debian, with its cross compiler and its arm64 libraries
# (examples/install_dependencies.sh arm64). Programs that run during the build run in qemu.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
