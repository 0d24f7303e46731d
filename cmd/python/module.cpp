// SPDX-License-Identifier: Apache-2.0
// The module peeler._peeler: errors, interrupts, and the verbs that work from file to file.
#include <sstream>
#include <streambuf>

#include <peeler/error.h>
#include "cmd/cli/api_names.h"
#include "cmd/cli/command_line.h"
#include "cmd/cli/console.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/report.h"
#include "cmd/python/binding.h"
#include "core/base/parallel.h"

namespace peeler::python {

namespace {

/// Between two looks at signals and calls of a callback.
constexpr std::chrono::milliseconds kBetweenLooks{30};

constexpr std::pair<ErrorKind, const char*> kKinds[] = {
    {ErrorKind::kInternal, "internal"}, {ErrorKind::kUsage, "usage"},
    {ErrorKind::kInput, "input"},       {ErrorKind::kOutput, "output"},
    {ErrorKind::kDevice, "device"},     {ErrorKind::kIncomplete, "incomplete"},
    {ErrorKind::kMemory, "memory"},
};

const char* kindName(ErrorKind kind) {
    for (const auto& [of, name] : kKinds)
        if (of == kind) return name;
    return "internal";
}

void raise(const Error& error) {
    const py::object type = py::module_::import("peeler._error").attr("Error");
    const auto text = [](const std::string& said) {
        return py::reinterpret_steal<py::object>(
            PyUnicode_DecodeFSDefault(inKeywords(cmd::inOptions(said)).c_str()));
    };
    const py::object raised =
        type(kindName(error.kind()), text(error.what()), text(error.where()), text(error.hint()));
    PyErr_SetObject(type.ptr(), raised.ptr());
}

/// Reads what a verb says on stderr: progress as JSON, warnings, errors.
class Messages final : public std::streambuf {
  public:
    explicit Messages(Watch watch) : watch_(std::move(watch)) {}

    std::vector<std::string> warnings, errors;

    /// Throws the exception of the watch, if there was one.
    void rethrow() const {
        if (thrown_) std::rethrow_exception(thrown_);
    }

  protected:
    int_type overflow(int_type c) override {
        if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
        const char one = traits_type::to_char_type(c);
        xsputn(&one, 1);
        return c;
    }
    std::streamsize xsputn(const char* text, std::streamsize size) override {
        line_.append(text, static_cast<std::size_t>(size));
        for (std::size_t end; (end = line_.find('\n')) != std::string::npos;) {
            const std::string line = line_.substr(0, end);
            line_.erase(0, end + 1);
            take(line);
        }
        return size;
    }

  private:
    void take(const std::string& line) {
        constexpr std::string_view kProgress = "\"progress\":";
        constexpr std::string_view kWarning = "peeler: warning: ", kError = "peeler: error: ";
        if (line.starts_with('{')) {
            const std::size_t at = line.find(kProgress);
            if (at != std::string::npos) tell(std::stod(line.substr(at + kProgress.size())));
        } else if (line.starts_with(kWarning)) {
            warnings.push_back(line.substr(kWarning.size()));
        } else if (line.starts_with(kError)) {
            errors.push_back(line.substr(kError.size()));
        }
    }

    void tell(double share) {
        try {
            watch_(share);
        } catch (...) {
            thrown_ = std::current_exception();
            // Verbs let this one pass: none reports it or goes on to the next picture.
            throw cmd::ReaderGone{};
        }
    }

    Watch watch_;
    std::string line_;
    std::exception_ptr thrown_;
};

/// Keeps a variable of the environment as it is, whatever a verb makes of it for processes of its
/// own: this one belongs to somebody else.
class KeptVariable {
  public:
    explicit KeptVariable(const char* name) : name_(name) {
        if (const char* const value = std::getenv(name)) value_ = value;
    }
    ~KeptVariable() {
        if (value_)
            setenv(name_, value_->c_str(), 1);
        else
            unsetenv(name_);
    }
    KeptVariable(const KeptVariable&) = delete;
    KeptVariable& operator=(const KeptVariable&) = delete;

  private:
    const char* name_;
    std::optional<std::string> value_;
};

/// Does what the verb does, in this process, and returns its result.
py::object runVerb(const cmd::Verb& verb, const py::args& files, py::dict given) {
    const std::string name(verb.name);
    Watch watch(Keywords::take(given, "progress"));
    for (const char* const other : {"json", "quiet", "verbose"}) {
        if (given.contains(other))
            throw py::type_error(name + "() got an unexpected keyword argument '" + other + "'");
    }
    cmd::ArgumentParser parser;
    cmd::VerbOptions options = parser.addVerb(name, std::string(verb.summary));
    const cmd::VerbAction action = verb.declare(options);
    std::vector<std::string> inputs;
    for (const py::handle& file : files)
        inputs.push_back(pathOf(py::reinterpret_borrow<py::object>(file)));
    std::vector<std::string> arguments{name};
    for (std::string& argument :
         asArguments(name, parser.describe().verbs.front().options, given, inputs)) {
        if (argument.starts_with("--output=-"))
            throw Error(ErrorKind::kUsage, "standard output is the program's own", "output",
                        "name a file");
        arguments.push_back(std::move(argument));
    }
    for (const char* const own : {"--json", "--quiet"})
        if (options.knows(own)) arguments.emplace_back(own);
    if (options.knows("--progress")) arguments.emplace_back("--progress=json");
    parser.parse(arguments);

    Messages messages(std::move(watch));
    std::ostringstream result;
    unlocked([&] {
        const KeptVariable gpus("CUDA_VISIBLE_DEVICES"), threads("LP_NUM_THREADS");
        std::ostream said(&messages);
        said.exceptions(std::ios::badbit);  // ReaderGone comes through
        cmd::Console console(result, said, false);
        int code = 0;
        try {
            cmd::Session session(console);
            code = action(session);
        } catch (const cmd::ReaderGone&) {
        }
        messages.rethrow();
        if (code != 0 && result.str().empty()) {
            throw Error(static_cast<ErrorKind>(code),
                        messages.errors.empty() ? name + " failed" : messages.errors.front());
        }
    });
    warn(messages.warnings);
    return result.str().empty() ? py::none() : toPython(result.str());
}

/// What help() says of a verb: its options as keywords.
std::string helpOf(const cmd::Verb& verb) {
    cmd::ArgumentParser parser;
    cmd::VerbOptions options = parser.addVerb(std::string(verb.name), "");
    verb.declare(options);
    const cmd::CommandDescription command = parser.describe().verbs.front();
    std::string text = inKeywords(std::string(verb.summary)) + "\n\n" + "What `peeler " +
                       std::string(verb.name) +
                       "` does, in this process, from files to files; returns its JSON result "
                       "as a dict.\nFiles come first, then keywords:\n\n";
    for (const cmd::OptionDescription& option : command.options) {
        std::string name;
        for (const std::string& n : option.names)
            if (n.starts_with("--") && n != "--help" && n != "--json" && n != "--quiet" &&
                n != "--verbose" && n != "--progress")
                name = name.empty() ? keywordOf(n) : name;
        if (name.empty()) continue;
        text += "    " + name + (option.value_name.empty() ? ": bool" : ": " + option.value_name) +
                "\n        " + inKeywords(option.help) + '\n';
        for (const cmd::ChoiceDescription& choice : option.choices)
            if (!choice.name.empty()) text += "        - " + choice.name + '\n';
    }
    return text + "    progress: callable\n        called with the share that is done, 0 to 1\n";
}

/// Of those that return data. `batch` and `worker` start processes.
bool isOffered(const cmd::Verb& verb) {
    return verb.name != "batch" && verb.name != "worker";
}

}  // namespace

Watch::Watch(py::object progress)
    : progress_(new py::object(std::move(progress)),
                [](py::object* held) {
                    const py::gil_scoped_acquire lock;
                    delete held;
                }),
      last_(std::make_shared<std::chrono::steady_clock::time_point>()) {
    if (!progress_->is_none() && PyCallable_Check(progress_->ptr()) == 0)
        throw py::type_error("progress is called with the share that is done: it must be callable");
}

void Watch::operator()(double share) const {
    const auto now = std::chrono::steady_clock::now();
    if (share < 1 && now - *last_ < kBetweenLooks) return;
    *last_ = now;
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!progress_->is_none()) (*progress_)(share);
}

py::object toPython(const std::string& json) {
    return py::module_::import("json").attr("loads")(
        py::reinterpret_steal<py::object>(PyUnicode_DecodeUTF8(
            json.data(), static_cast<py::ssize_t>(json.size()), "surrogateescape")));
}

py::object toPython(const nlohmann::ordered_json& json) {
    return toPython(cmd::jsonText(json));
}

void warn(const std::vector<std::string>& sentences) {
    for (const std::string& sentence : sentences) {
        if (PyErr_WarnEx(PyExc_UserWarning, inKeywords(cmd::inOptions(sentence)).c_str(), 1) != 0)
            throw py::error_already_set();
    }
}

void defineVerbs(py::module_& module) {
    for (const cmd::Verb& verb : cmd::verbs()) {
        if (!isOffered(verb)) continue;
        const std::string name(verb.name), help = helpOf(verb);
        module.def(
            name.c_str(),
            [&verb](const py::args& files, const py::kwargs& keywords) {
                return runVerb(verb, files, py::dict(keywords.attr("copy")()));
            },
            help.c_str());
    }
}

}  // namespace peeler::python

PYBIND11_MODULE(_peeler, module) {
    namespace py = pybind11;
    using namespace peeler;
    py::options options;
    options.disable_function_signatures();  // the stub has them
    module.attr("__version__") = PEELER_VERSION;
    // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 hands it over so
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const Error& error) {
            python::raise(error);
        } catch (const std::bad_alloc&) {
            python::raise(Error(ErrorKind::kMemory, "out of memory"));
        }
    });
    python::defineVerbs(module);
    python::defineImages(module);
    python::defineScenes(module);
    python::defineHits(module);
    python::defineRenderer(module);
    python::defineFindings(module);
}
