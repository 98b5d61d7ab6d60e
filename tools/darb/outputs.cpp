// SPDX-License-Identifier: MIT
#include "tools/darb/outputs.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/system_files.h"
#include "engine/core/user_folders.h"
#include "engine/scene/project_file.h"
#include "trainer/job/scene_file.h"
#include "trainer/run/run_folder.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

// Whether `path` is a regular file that is there; `identity` then becomes the file's.
bool identify(const fs::path& path, FileId& identity) {
    const FileFacts facts = file_facts(path);
    identity = facts.id;
    return facts.kind == FileKind::regular;
}

bool counts(const fs::path& path) {
    std::error_code none;
    return !path.empty() && path != "-" && (fs::is_regular_file(path) || !fs::exists(path, none));
}

// Whether a file of this name describes the folder in which it lies.
bool describes(const fs::path& path) {
    constexpr std::array names{"meta.json",    "metrics.json",    "cameras.json",
                               "command.json", "exposure.json",   "run.jsonl",
                               "cfg_args",     "checkpoint.darb", "lod-meta.json"};
    const std::string name = path.filename().string();
    for (const char* one : names)
        if (name == one) return true;
    if (name.starts_with("transforms") && name.ends_with(".json")) return true;
    for (const char* ending : {".bin", ".txt", ".ply"})
        if (has_extension(path, ending)) return true;
    return false;
}

bool begins_with(const std::vector<std::byte>& bytes, std::string_view text) {
    return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

// Recognises a user's work by its first bytes, whatever its name. Returns what it is, or "".
std::string_view work_in(const fs::path& path) {
    constexpr std::size_t kHead = 8;
    std::vector<std::byte> head;
    try {
        head = read_file_head(path, kHead);
    } catch (const Error&) {
        return "";  // the writer will say why it cannot be written
    }
    if (begins_with(head, "\x89PNG") || begins_with(head, "\xff\xd8\xff")) return "a picture";
    for (const std::string_view scene : {"ply\n", "ply\r", "NGSP", "glTF", "PK\x03\x04"})
        if (begins_with(head, scene)) return "a scene";
    const bool named = has_extension(path, ".splat") || has_extension(path, ".spz") ||
                       has_extension(path, ".ksplat");
    return named && !head.empty() ? "a scene" : "";
}

void refuse_to_lose_work(const fs::path& output) {
    const std::string_view work = work_in(output);
    if (work.empty()) return;
    const bool picture = has_extension(output, ".png") || has_extension(output, ".jpg") ||
                         has_extension(output, ".jpeg");
    if (work == "a picture" && picture) return;
    throw Error(output.string(), fmt::format("already exists, and is {}", work),
                "Name another file to write, or delete it first.");
}

void add_described(const fs::path& folder, Paths& files) {
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none))
        if (describes(entry.path())) files.push_back(entry.path());
}

}  // namespace

Paths files_of(const fs::path& input) {
    if (input.empty()) return {};
    Paths files{input};
    std::error_code none;
    if (is_project_file(input) && fs::is_regular_file(input, none))
        for (const fs::path& file : files_of_project(read_project(input)))
            for (const fs::path& part : files_of(file)) files.push_back(part);
    const bool folder = fs::is_directory(input, none);
    const fs::path beside = folder ? input : input.parent_path();
    if (folder) {
        for (const char* part : {"", "sparse", "sparse/0", "0", "colmap/sparse/0"})
            add_described(input / part, files);
        if (const fs::path scene = scene_of_run(input); !scene.empty()) files.push_back(scene);
    }
    if ((folder || names_scene_folder(input)) && scene_file_in(beside))
        for (const fs::directory_entry& entry : fs::directory_iterator(beside, none)) {
            if (has_extension(entry.path(), ".webp")) files.push_back(entry.path());
            for (const fs::directory_entry& part : fs::directory_iterator(entry.path(), none))
                files.push_back(part.path());  // a part of a streamed scene
        }
    if (has_extension(input, ".gltf"))
        for (const fs::directory_entry& entry :
             fs::directory_iterator(beside.empty() ? fs::path(".") : beside, none))
            if (has_extension(entry.path(), ".bin")) files.push_back(entry.path());
    return files;
}

Paths files_of(const std::vector<View>& views) {
    Paths files;
    for (const View& view : views) {
        files.push_back(view.photo);
        files.push_back(view.mask);
        files.push_back(view.depth);
    }
    return files;
}

Paths outputs_of(const fs::path& output, const EncodedSplats& encoded) {
    Paths outputs{output};
    for (const auto& one : encoded.beside) outputs.push_back(output.parent_path() / one.first);
    return outputs;
}

void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs, Replaces replaces) {
    std::map<FileId, fs::path> there;  // the outputs that exist
    std::map<fs::path, bool> named;
    FileId identity{};
    for (const fs::path& output : outputs) {
        if (!counts(output)) continue;
        std::error_code none;
        const bool twice = !named.emplace(fs::weakly_canonical(output, none), true).second;
        if (twice || (identify(output, identity) && !there.emplace(identity, output).second))
            throw Error(output.string(), "is to be written twice", "Name two files.");
    }
    if (there.empty()) return;
    for (const fs::path& input : inputs)
        if (identify(input, identity))
            if (const auto at = there.find(identity); at != there.end())
                throw Error(at->second.string(), "is what is read", "Name another file to write.");
    if (replaces == Replaces::all) return;
    for (const auto& one : there) refuse_to_lose_work(one.second);
}

void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs) {
    refuse_to_overwrite_inputs(outputs, inputs, Replaces::reports);
}

namespace {

using nlohmann::json;

constexpr std::size_t kMostWritten = 10'000;  // how many files are remembered, the newest ones

std::string whole_name(const fs::path& path) {
    std::error_code none;
    const fs::path whole = fs::weakly_canonical(path, none);
    return (none ? fs::absolute(path, none) : whole).lexically_normal().string();
}

/// Size and time of the last change; the work of another program shows in one of them.
bool stamp_of(const fs::path& path, std::int64_t& bytes, std::int64_t& changed_ns) {
    const FileFacts facts = file_facts(path);
    bytes = std::int64_t(facts.bytes);
    changed_ns = facts.changed_ns;
    return facts.kind == FileKind::regular;
}

/// The list of written files; empty where there is none or the file is something else.
json read_record(const fs::path& record) {
    std::error_code none;
    if (record.empty() || !fs::is_regular_file(record, none)) return json::array();
    try {
        const json whole = json::parse(read_text_file(record));
        if (whole.is_object() && whole.contains("written") && whole["written"].is_array())
            return whole["written"];
    } catch (const std::exception&) {  // the file is rewritten
    }
    return json::array();
}

bool names_file(const json& entry, const std::string& file) {
    return entry.is_object() && entry.value("file", json()) == json(file);
}

bool counts_as_output(const fs::path& path) {
    return !path.empty() && path != "-";
}

}  // namespace

WrittenFiles::WrittenFiles(const Paths& sources, bool force) : force_(force) {
    for (const fs::path& source : sources) sources_.push_back(whole_name(source));
    std::ranges::sort(sources_);
    if (const fs::path folder = state_folder(); !folder.empty()) record_ = folder / "written.json";
}

bool WrittenFiles::is_ours(const json& record, const fs::path& output) const {
    std::int64_t bytes = 0, changed_ns = 0;
    if (!stamp_of(output, bytes, changed_ns)) return false;
    const std::string name = whole_name(output);
    for (const json& entry : record)
        if (names_file(entry, name))
            return entry.value("bytes", json()) == json(bytes) &&
                   entry.value("changed_ns", json()) == json(changed_ns) &&
                   (sources_.empty() || entry.value("sources", json()) == json(sources_));
    return false;
}

void WrittenFiles::check(const Paths& outputs) const {
    const json record = read_record(record_);
    for (const fs::path& output : outputs) {
        if (!counts_as_output(output)) continue;
        std::error_code none;
        const fs::file_status status = fs::status(output, none);
        if (status.type() == fs::file_type::directory)
            throw Error(output.string(), "is a folder", "Name a file to write.");
        std::int64_t bytes = 0, changed_ns = 0;
        if (force_ || !stamp_of(output, bytes, changed_ns) || bytes == 0 || is_ours(record, output))
            continue;
        throw Error(output.string(),
                    sources_.empty()
                        ? "already exists, and was not written by darb"
                        : "already exists, and was not written by darb from this scene",
                    "Name another file to write, or add --force to replace it.");
    }
}

void WrittenFiles::wrote(const Paths& outputs) const {
    if (record_.empty()) return;
    json list = read_record(record_), fresh = json::array();
    std::set<std::string> again;
    for (const fs::path& output : outputs) {
        std::int64_t bytes = 0, changed_ns = 0;
        if (!counts_as_output(output) || !stamp_of(output, bytes, changed_ns)) continue;
        const std::string name = whole_name(output);
        again.insert(name);
        fresh.push_back(
            {{"file", name}, {"bytes", bytes}, {"changed_ns", changed_ns}, {"sources", sources_}});
    }
    const std::size_t room = kMostWritten - std::min(kMostWritten, fresh.size());
    std::size_t skip = list.size() - std::min(list.size(), room);  // the oldest
    json kept = json::array();
    for (json& entry : list) {
        if (skip > 0 && skip--) continue;
        const json file = entry.is_object() ? entry.value("file", json()) : json();
        if (file.is_string() && !again.contains(file.get<std::string>()))
            kept.push_back(std::move(entry));
    }
    for (json& entry : fresh) kept.push_back(std::move(entry));
    try {
        write_file_atomic(
            record_,
            json{{"written", kept}}.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
    } catch (const Error&) {  // darb asks the next time
    }
}

CLI::Option* add_quiet_flag(CLI::App& command, bool& quiet) {
    const auto take = [&quiet](std::int64_t times) { leave_out_notes(quiet = times > 0); };
    return command.add_flag_function("-q,--quiet", take, "print paths, warnings and errors only");
}

void tell_paths(bool quiet, const Paths& written) {
    for (const fs::path& path : written)
        if (quiet && !path.empty() && path != "-") tell("{}\n", path.string());
}

Paths together(std::initializer_list<Paths> lists) {
    Paths all;
    for (const Paths& list : lists) all.insert(all.end(), list.begin(), list.end());
    return all;
}

CLI::Option* add_json_option(CLI::App& command, std::filesystem::path& json) {
    return command.add_option("--json", json, "write every number to this file; - is stdout");
}

CLI::Option* add_paper_option(CLI::App& command, std::filesystem::path& folder) {
    return command.add_option("--paper", folder,
                              "write the tables into this folder as CSV and LaTeX, and the plots "
                              "as SVG and PDF; report.tex shows them");
}

void check_paper_folder(const fs::path& folder) {
    std::error_code none;
    if (!folder.empty() && fs::exists(folder, none) && !fs::is_directory(folder, none))
        throw Error(folder.string(), "is a file, and --paper takes a folder",
                    "Name another one; it is made where it does not exist.");
}

void write_paper(const fs::path& folder, const Report& report, const Paths& inputs) {
    if (folder.empty()) return;
    check_paper_folder(folder);
    Paths files;
    for (const ReportFile& file : report.files()) files.push_back(folder / file.name);
    refuse_to_overwrite_inputs(files, inputs);
    write_paper_files(folder, report);
}

std::FILE* stream_beside_json(const std::filesystem::path& json, bool quiet) {
    return quiet ? nullptr : json == "-" ? stderr : stdout;
}

void write_json(const std::filesystem::path& to, const nlohmann::json& json) {
    if (to.empty()) return;
    const bool shown = to == "-";  // names may hold any bytes, even ones that control a terminal
    const std::string text =
        json.dump(2, ' ', shown, nlohmann::json::error_handler_t::replace) + "\n";
    shown ? tell_text(text) : write_file_atomic(to, text);
}

std::string name_in_json(const std::filesystem::path& to, const std::filesystem::path& path) {
    const std::filesystem::path folder = to == "-" ? "." : to.parent_path();
    return shared_name(folder.empty() ? "." : folder, path);
}

void leave_folders_out(nlohmann::json& texts, const std::filesystem::path& path) {
    if (texts.is_string()) texts = without_folders(texts.get<std::string>(), path);
    if (texts.is_structured())
        for (nlohmann::json& one : texts) leave_folders_out(one, path);
}

}  // namespace darb
