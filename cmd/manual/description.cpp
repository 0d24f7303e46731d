// SPDX-License-Identifier: Apache-2.0
#include "cmd/manual/description.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "cmd/cli/report.h"

namespace peeler::cmd {

namespace {

Json optionJson(const OptionDescription& option) {
    Json json{{"names", option.names},
              {"value", option.value_name},
              {"group", option.group},
              {"help", option.help}};
    json["choices"] = Json::array();
    for (const ChoiceDescription& choice : option.choices)
        if (!choice.name.empty()) json["choices"].push_back(choice.name);
    const std::pair<const char*, bool> facts[] = {{"list", option.takes_list},
                                                  {"required", option.required},
                                                  {"repeated", option.repeated},
                                                  {"file", option.is_file}};
    for (const auto& [name, is_true] : facts)
        if (is_true) json[name] = true;
    return json;
}

}  // namespace

std::string describeAsJson(const CommandDescription& program) {
    Json json;
    json["version"] = PEELER_VERSION;
    for (const CommandDescription& verb : program.verbs) {
        Json& described = json["verbs"][verb.name];
        described = {{"summary", verb.summary}, {"options", Json::array()}};
        for (const OptionDescription& option : verb.options)
            described["options"].push_back(optionJson(option));
    }
    return jsonText(json);
}

}  // namespace peeler::cmd
