// SPDX-License-Identifier: Apache-2.0
// A shared library that finds modules relative to its own path, as peeler does.
#include <cstring>
#include <string>

#include <peeler/error.h>
#include "formats/file/module.h"

/// Writes a module's path to `text`, or the message and place of the error.
extern "C" void findModule(const char* name, char* text, std::size_t size) {
    std::string answer;
    try {
        answer = peeler::moduleFile(name).string();
    } catch (const peeler::Error& error) {
        answer = error.what() + (": " + error.where());
    }
    std::strncpy(text, answer.c_str(), size - 1);
    text[size - 1] = '\0';
}
