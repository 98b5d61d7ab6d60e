// SPDX-License-Identifier: MIT
// Reports of several machines as one, and the schema of their file.
#include "tools/paper/compare_merge.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "tools/paper/compare_stats.h"

namespace darb {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

/// What the value breaks of the schema, as "path: why"; empty where it fits. Knows the words that
/// our schema uses.
std::string broken(const Json& value, const Json& schema, const Json& root,
                   const std::string& path = "$") {
    if (schema.contains("$ref"))
        return broken(value,
                      root.at(Json::json_pointer(schema["$ref"].get<std::string>().substr(1))),
                      root, path);
    if (schema.contains("const") && value != schema["const"]) return path + ": another constant";
    if (schema.contains("type")) {
        const Json types = schema["type"].is_array() ? schema["type"] : Json{schema["type"]};
        bool fits = false;
        for (const std::string type : types)
            fits |=
                (type == "object" && value.is_object()) || (type == "array" && value.is_array()) ||
                (type == "string" && value.is_string()) ||
                (type == "boolean" && value.is_boolean()) || (type == "null" && value.is_null()) ||
                (type == "integer" && value.is_number_integer()) ||
                (type == "number" && value.is_number());
        if (!fits) return path + ": is a " + value.type_name();
    }
    if (value.is_object()) {
        for (const std::string name : schema.value("required", Json::array()))
            if (!value.contains(name)) return path + ": has no " + name;
        const Json known = schema.value("properties", Json::object());
        for (const auto& [name, member] : value.items()) {
            if (!known.contains(name)) {
                if (!schema.value("additionalProperties", true)) return path + ": unknown " + name;
                continue;
            }
            if (const std::string why = broken(member, known[name], root, path + "." + name);
                !why.empty())
                return why;
        }
    }
    if (value.is_array() && schema.contains("items"))
        for (std::size_t i = 0; i < value.size(); ++i)
            if (const std::string why =
                    broken(value[i], schema["items"], root, fmt::format("{}[{}]", path, i));
                !why.empty())
                return why;
    return "";
}

ComparedRun run_of(const std::string& kernel, std::uint64_t seed, double psnr_db) {
    ComparedRun run;
    run.kernel = kernel;
    run.seed = seed;
    run.folder = "out/set/" + kernel;
    run.peak_mb = 12;
    run.curve = {{5, 0.5, 0.25, 100}};
    ComparedAt& at = run.at.emplace_back();
    at.iteration = 7000;
    at.psnr_db = psnr_db;
    at.ssim = 0.5;
    at.seconds = 3;
    at.splats = 7;
    at.flip = 0.25;
    at.views = {{"a.png", psnr_db, 0.5, 0.125, {}, 0.25}};
    at.scales = {{0.5, psnr_db + 1, 0.6}};
    return run;
}

Comparison report(const std::string& device, const std::vector<ComparedRun>& runs) {
    Comparison c;
    c.machines = {{device, "driver"}};
    c.device = device + ", driver";
    c.iterations = {7000};
    c.scales = {0.5};
    c.settings = "Options of training: the defaults.";
    c.lpips_note = "LPIPS was left out.";
    ComparedDataset& set = c.datasets.emplace_back();
    set.name = set.path = "set";
    set.fingerprint = "f";
    set.width = 40;
    set.height = 30;
    set.runs = runs;
    for (const ComparedRun& run : runs)
        if (std::find(c.kernels.begin(), c.kernels.end(), run.kernel) == c.kernels.end())
            c.kernels.push_back(run.kernel);
    return c;
}

std::string refusal(const Comparison& a, const Comparison& b) {
    try {
        merge_comparisons({"a.json", "b.json"}, {a, b});
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

TEST(CompareFormat, OurFile_fitsTheSchemaAndComesBackWhole) {
    const Json schema =
        Json::parse(read_text_file(fs::path(DARB_SOURCE_DIR) / "docs/compare.schema.json"));
    Comparison c = report("A", {run_of("gaussian", 0, 20), run_of("gaussian", 1, 21),
                                run_of("gaussian", 2, 22), run_of("sinc", 0, 21)});
    c.seeds = 3;
    ComparedRun& run = c.datasets[0].runs[0];
    run.blending = BlendStatistics{1, 2, 3, 4, 5};
    run.shapes = LearnedShapes{{1, 4, 16}, {0.25, 0.75}, {1.5, 2.5, 5.5, 6.5, 7.5}};
    run.failure = "lost";
    c.datasets[0].runs[1].at[0].psnr_db = std::nan("");
    const Json json = Json::parse(comparison_json(c).dump());
    EXPECT_EQ(broken(json, schema, schema), "");
    EXPECT_EQ(Json::parse(comparison_json(parse_comparison(json, "compare.json")).dump()), json);

    Json wrong = json;
    wrong["datasets"][0]["runs"][1]["at"][0]["ssim"] = "high";
    EXPECT_EQ(broken(wrong, schema, schema), "$.datasets[0].runs[1].at[0].ssim: is a string");
    wrong = json;
    wrong.erase("settings");
    EXPECT_EQ(broken(wrong, schema, schema), "$: has no settings");
    EXPECT_THROW(parse_comparison(wrong, "x.json"), Error);
}

TEST(CompareFormat, OtherFiles_areRefusedByName) {
    for (const char* text : {"[]", "{}", R"({"format":"darb-compare","format_version":99})"}) try {
            parse_comparison(Json::parse(text), "folder/x.json");
            ADD_FAILURE() << text;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find("folder/x.json"), std::string::npos) << e.what();
        }
}

TEST(CompareMerge, SeedsAndKernelsOfOneMachine_becomeOneTable) {
    const MergedComparison merged = merge_comparisons(
        {"a.json", "b.json"}, {report("A", {run_of("gaussian", 0, 20)}),
                               report("A", {run_of("gaussian", 1, 22), run_of("sinc", 0, 21)})});
    EXPECT_TRUE(merged.repeated.empty());
    EXPECT_EQ(merged.comparison.kernels, (std::vector<std::string>{"gaussian", "sinc"}));
    EXPECT_EQ(merged.comparison.datasets.size(), 1u);
    EXPECT_EQ(
        *over_seeds(merged.comparison.datasets[0], "gaussian", 7000, quality_columns()[0]).mean,
        21);
}

TEST(CompareMerge, Machines_areKeptApartByName) {
    const MergedComparison merged = merge_comparisons(
        {"a.json", "b.json"},
        {report("A", {run_of("gaussian", 0, 20)}), report("B", {run_of("gaussian", 0, 20)})});
    EXPECT_EQ(merged.comparison.kernels,
              (std::vector<std::string>{"gaussian on A", "gaussian on B"}));
    ASSERT_EQ(merged.repeated.size(), 1u);
    EXPECT_TRUE(merged.repeated[0].same_bits);
    EXPECT_FALSE(merged.repeated[0].same_machine);
    EXPECT_EQ(merged.comparison.device, "A, driver; B, driver");
    // What was merged can be merged again.
    const Json json = comparison_json(merged.comparison);
    EXPECT_EQ(parse_comparison(json, "m.json").datasets[0].runs[1].machine, "B");
}

TEST(CompareMerge, CellsOfTwoReports_areComparedAndTakenOnce) {
    const MergedComparison merged = merge_comparisons(
        {"a.json", "b.json"},
        {report("A", {run_of("gaussian", 0, 20)}), report("A", {run_of("gaussian", 0, 20.25)})});
    EXPECT_EQ(merged.comparison.datasets[0].runs.size(), 1u);
    EXPECT_EQ(merged.comparison.datasets[0].runs[0].at[0].psnr_db, 20);
    ASSERT_EQ(merged.repeated.size(), 1u);
    EXPECT_FALSE(merged.repeated[0].agree());
    EXPECT_EQ(merged.repeated[0].psnr_db, 0.25);
    const std::string lines = repeated_lines(merged.repeated);
    EXPECT_NE(lines.find("disagreement: set, gaussian, seed 0"), std::string::npos) << lines;
    EXPECT_NE(lines.find("b.json has +0.2500 dB"), std::string::npos) << lines;
    EXPECT_NE(lines.find("on the same machine"), std::string::npos) << lines;
    EXPECT_EQ(repeated_table(merged.repeated).rows[0].cells.back().text, "no");
}

TEST(CompareMerge, WhatIsNotComparable_isRefusedWithTheReason) {
    const Comparison a = report("A", {run_of("gaussian", 0, 20)});
    EXPECT_EQ(refusal(a, a), "");
    const auto with = [&](const auto& change) {
        Comparison b = a;
        change(b);
        return refusal(a, b);
    };
    const auto has = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos && text.find("b.json") != std::string::npos;
    };
    EXPECT_TRUE(has(with([](Comparison& b) { b.iterations = {30000}; }), "after 30,000"));
    EXPECT_TRUE(has(with([](Comparison& b) { b.settings = "-r=4"; }), "-r=4"));
    EXPECT_TRUE(has(with([](Comparison& b) { b.datasets[0].width = 80; }), "80 x 30 px"));
    EXPECT_TRUE(has(with([](Comparison& b) { b.datasets[0].runs[0].at[0].views[0].name = "c"; }),
                    "holds other views out: 1 (a.png, ...) and 1 (c, ...)"));
    Comparison other = a;
    other.datasets[0].fingerprint = "g";
    EXPECT_EQ(merge_comparisons({"a.json", "b.json"}, {a, other}).notes.size(), 1u);
    Comparison vgg = a, alex = a;
    vgg.lpips_note = "LPIPS: VGG16";
    alex.lpips_note = "LPIPS: AlexNet";
    EXPECT_TRUE(has(refusal(vgg, alex), "AlexNet"));
    EXPECT_EQ(refusal(a, alex), "") << "one of them has none";
}

}  // namespace
}  // namespace darb
