// SPDX-License-Identifier: Apache-2.0
// Help text in lines.
#include "cmd/options.h"

namespace peeler::cmd {

std::string wrapped(const std::string& text) {
    constexpr std::size_t kColumns = 66;
    std::string out;
    std::size_t column = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
        const std::size_t word = end - at;
        if (column > 0 && column + 1 + word > kColumns) {
            out += '\n';
            column = 0;
        } else if (column > 0) {
            out += ' ';
            ++column;
        }
        out.append(text, at, word);
        column += word;
        if (end < text.size() && text[end] == '\n') {
            out += '\n';
            column = 0;
        }
        at = end + 1;
    }
    return out;
}

CLI::Option* addFiles(CLI::App& app, const std::string& name,
                      std::vector<std::filesystem::path>& files, const std::string& help) {
    const std::function<void(const std::vector<std::string>&)> assign =
        [&files](const std::vector<std::string>& texts) {
            files.assign(texts.begin(), texts.end());
        };
    return app.add_option_function<std::vector<std::string>>(name, assign, wrapped(help))
        ->option_text(" ")
        ->required();
}

}  // namespace peeler::cmd
