#include "tools/darb/outputs.h"

#include <sys/stat.h>

#include <array>
#include <map>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "tools/darb/scene_file.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

bool notes_left_out = false;  // by the -q of this process's command

using Identity = std::pair<dev_t, ino_t>;

// Of a regular file that is there.
bool identify(const fs::path& path, Identity& identity) {
    struct stat facts {};
    if (::stat(path.c_str(), &facts) != 0 || !S_ISREG(facts.st_mode)) return false;
    identity = {facts.st_dev, facts.st_ino};
    return true;
}

bool counts(const fs::path& path) {
    std::error_code none;
    return !path.empty() && path != "-" && (fs::is_regular_file(path) || !fs::exists(path, none));
}

// Whether a folder is read by files of this name.
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
                files.push_back(part.path());  // of a streamed scene
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

void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs) {
    std::map<Identity, fs::path> there;  // the outputs that are
    std::map<fs::path, bool> named;
    Identity identity;
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
}

CLI::Option* add_quiet_flag(CLI::App& command, bool& quiet) {
    const auto take = [&quiet](std::int64_t times) { notes_left_out = quiet = times > 0; };
    return command.add_flag_function("-q,--quiet", take, "print paths, warnings and errors only");
}

void say_note(std::string_view line) {
    if (!notes_left_out) say("{}\n", line);
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

}  // namespace darb
