// SPDX-License-Identifier: Apache-2.0
// Keywords of Python as options of the command line, and texts of the command line in keywords.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <regex>

#include <peeler/error.h>
#include "cmd/python/binding.h"
#include "core/base/names.h"

namespace peeler::python {

namespace {

/// Where an option is a word of Python's own.
constexpr const char* kReserved[] = {"as", "from", "in", "is", "with", "class", "global", "lambda"};

bool isNumber(const py::handle& value) {
    return !py::isinstance<py::bool_>(value) &&
           (PyLong_Check(value.ptr()) || PyFloat_Check(value.ptr()) ||
            PyObject_HasAttrString(value.ptr(), "__index__") ||
            (PyObject_HasAttrString(value.ptr(), "__float__") &&
             !PyObject_HasAttrString(value.ptr(), "__len__")));
}

bool isText(const py::handle& value) {
    return PyUnicode_Check(value.ptr()) || PyBytes_Check(value.ptr()) ||
           PyObject_HasAttrString(value.ptr(), "__fspath__");
}

bool isMapping(const py::handle& value) {
    return PyDict_Check(value.ptr());
}

/// The shortest digits that read back as the number.
std::string numberText(const py::handle& value) {
    if (PyObject_HasAttrString(value.ptr(), "__index__"))
        return py::str(py::int_(py::reinterpret_borrow<py::object>(value)));
    const double number = py::float_(py::reinterpret_borrow<py::object>(value));
    if (std::isinf(number)) return number > 0 ? "inf" : "-inf";
    return py::repr(py::float_(number));
}

std::string scalarText(const std::string& keyword, const py::handle& value) {
    if (isText(value)) return pathOf(py::reinterpret_borrow<py::object>(value));
    if (isNumber(value)) return numberText(value);
    throw Error(ErrorKind::kUsage,
                "expected a number, a text or a sequence of them, not " +
                    std::string(py::str(py::type::of(value).attr("__name__"))),
                keyword);
}

/// All numbers and texts of sequences in sequences.
void flatten(const std::string& keyword, const py::handle& value, std::vector<std::string>& out) {
    if (isText(value) || isNumber(value)) {
        out.push_back(scalarText(keyword, value));
        return;
    }
    if (!PyObject_HasAttrString(value.ptr(), "__iter__")) {
        out.push_back(scalarText(keyword, value));  // which throws
        return;
    }
    for (const py::handle& item : value)
        flatten(keyword, item, out);
}

std::string joined(const std::vector<std::string>& texts, const char* between) {
    std::string text;
    for (std::size_t i = 0; i < texts.size(); ++i)
        text += (i == 0 ? "" : between) + texts[i];
    return text;
}

/// The texts of a value, each of which is given as the option once.
std::vector<std::string> textsOf(const std::string& keyword, const cmd::OptionDescription& option,
                                 const py::handle& value) {
    if (isMapping(value)) {  // attenuation={"steel": 0.5}
        std::vector<std::string> texts;
        for (const auto& [key, of_key] : py::reinterpret_borrow<py::dict>(value))
            texts.push_back(scalarText(keyword, key) + '=' + scalarText(keyword, of_key));
        return texts;
    }
    if (isText(value) || isNumber(value)) return {scalarText(keyword, value)};
    std::vector<std::string> all;
    if (option.repeated) {
        // One vector, or several of them.
        bool plain = true;
        for (const py::handle& item : value)
            plain = plain && isNumber(item);
        if (!plain) {
            for (const py::handle& item : value) {
                std::vector<std::string> one;
                flatten(keyword, item, one);
                all.push_back(joined(one, ","));
            }
            return all;
        }
    }
    flatten(keyword, value, all);
    return {joined(all, option.value_name.starts_with("WxH") ? "x" : ",")};
}

struct Named {
    const cmd::OptionDescription* option = nullptr;
    std::string name;  ///< "--no-refine"
};

}  // namespace

std::string keywordOf(const std::string& option) {
    std::string keyword = option.substr(std::min(option.find_first_not_of('-'), option.size()));
    std::ranges::replace(keyword, '-', '_');
    if (std::ranges::find(kReserved, keyword) != std::end(kReserved)) keyword += '_';
    return keyword;
}

std::string inKeywords(const std::string& text) {
    static const std::regex option("--[a-z][a-z-]*");
    static const std::regex help("see peeler ([a-z]*) ?--help");
    static const std::regex verb("\\bpeeler (devices|info|check|verify|convert|merge|flatten)\\b");
    std::string said = std::regex_replace(text, help, "see help(peeler)");
    said = std::regex_replace(said, verb, "peeler.$1()");
    std::string out;
    auto from = said.cbegin();
    for (std::sregex_iterator found(said.begin(), said.end(), option), end; found != end; ++found) {
        out.append(from, (*found)[0].first);
        out += keywordOf(found->str());
        from = (*found)[0].second;
    }
    return out.append(from, said.cend());
}

std::string pathOf(const py::object& path) {
    const auto bytes = py::reinterpret_steal<py::object>(
        PyUnicode_Check(path.ptr())
            ? PyUnicode_EncodeFSDefault(path.ptr())
            : py::module_::import("os").attr("fsencode")(path).release().ptr());
    if (!bytes) throw py::error_already_set();
    if (PyBytes_Size(bytes.ptr()) == 0) throw Error(ErrorKind::kUsage, "the name is empty", "path");
    return bytes.cast<std::string>();
}

std::vector<std::string> asArguments(const std::string& call,
                                     const std::vector<cmd::OptionDescription>& options,
                                     const py::dict& given, const std::vector<std::string>& files) {
    std::map<std::string, Named> known;
    std::vector<std::string> keywords;
    for (const cmd::OptionDescription& option : options) {
        for (const std::string& name : option.names) {
            if (!name.starts_with("--") || name == "--help") continue;
            known[keywordOf(name)] = {&option, name};
            keywords.push_back(keywordOf(name));
        }
    }
    std::vector<std::string> arguments;
    for (const std::string& file : files)
        arguments.push_back(file.starts_with('-') ? "./" + file : file);
    for (const auto& [key, value] : given) {
        const auto keyword = key.cast<std::string>();
        const auto found = known.find(keyword);
        if (found == known.end()) {
            const std::vector<std::string_view> names(keywords.begin(), keywords.end());
            const std::string_view nearest = nearestName(keyword, names);
            std::string text = call + "() got an unexpected keyword argument '";
            text.append(keyword).append("'");
            if (!nearest.empty()) text.append("; did you mean '").append(nearest).append("'?");
            throw py::type_error(text);
        }
        if (value.is_none()) continue;
        const auto& [option, name] = found->second;
        if (!option->value_name.empty()) {
            if (py::isinstance<py::bool_>(value))
                throw Error(ErrorKind::kUsage, "expected a value, not True or False", keyword);
            for (const std::string& text : textsOf(keyword, *option, value))
                arguments.push_back(std::string(name).append("=").append(text));
            continue;
        }
        const int truth = PyObject_IsTrue(value.ptr());
        if (truth < 0) throw py::error_already_set();
        const std::string opposite =
            name.starts_with("--no-") ? "--" + name.substr(5) : "--no-" + name.substr(2);
        if (truth == 1)
            arguments.push_back(name);
        else if (std::ranges::find(option->names, opposite) != option->names.end())
            arguments.push_back(opposite);
    }
    return arguments;
}

Keywords::Keywords(const std::string& call) : call_(call), options_(parser_.addVerb(call, "")) {}

py::object Keywords::take(py::dict& given, const char* name) {
    if (!given.contains(name)) return py::none();
    return given.attr("pop")(name);
}

void Keywords::parse(const py::dict& given, const std::vector<std::string>& files) {
    std::vector<std::string> arguments{call_};
    if (!given.empty() || !files.empty()) {
        const cmd::CommandDescription command = parser_.describe().verbs.front();
        for (std::string& argument : asArguments(call_, command.options, given, files))
            arguments.push_back(std::move(argument));
    }
    parser_.parse(arguments);
}

}  // namespace peeler::python
