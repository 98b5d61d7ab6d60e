// SPDX-License-Identifier: MIT
// The form of a training run: its fields come from the table of options, and errors stand beside
// the field that they are about.
#include "tools/darb/train_form.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <set>

#include "trainer/job/request_options.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

class TrainFormTest : public testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(photos_);
        form_.fields = train_fields();
        type(kDatasetField, photos_.string());
    }
    void TearDown() override { fs::remove_all(photos_); }
    void type(const char* name, const std::string& text) {
        TrainField* const field = form_.field(name);
        ASSERT_NE(field, nullptr) << name;
        field->typed = text;
    }
    // The fields that have an error.
    std::set<std::string> wrong() const {
        std::set<std::string> names;
        for (const TrainField& field : form_.fields)
            if (!field.error.empty()) names.insert(field.name);
        return names;
    }

    fs::path photos_ =
        fs::temp_directory_path() / ("darb_train_form_" + std::to_string(::getpid())) / "house";
    TrainForm form_;
};

TEST_F(TrainFormTest, has_a_field_for_each_option_and_a_few_for_everybody) {
    std::set<std::string> names;
    std::size_t first = 0;
    for (const TrainField& field : form_.fields) {
        EXPECT_TRUE(names.insert(field.name).second) << field.name << " twice";
        EXPECT_FALSE(field.label.empty() || field.help.empty()) << field.name;
        if (!field.heading.empty()) continue;
        EXPECT_EQ(++first, names.size()) << field.name << " is not in front";
    }
    EXPECT_EQ(first, 9U);
    for (const RequestOption& option : request_options()) {
        const std::string name = *option.row.flags == '\0' ? "" : option_name(option.row);
        const bool none = name.empty() || name == "--blocks" || name == "--resume" ||
                          name == "--allow-mixed" || name == "--start-checkpoint";
        EXPECT_EQ(names.contains(name), !none) << name;
    }
}

TEST_F(TrainFormTest, means_what_the_command_means) {
    type("--preset", "preview");
    type("--max-splats", "12000");
    type("--max-memory", "1.5GB");
    type("--roi", "sphere:0,0,0,2");
    type("--kernel", "raised_cosine");
    TrainRequest command;
    set_request_options(command, {{"--source-path", photos_.string()},
                                  {"--preset", "preview"},
                                  {"--max-splats", "12000"},
                                  {"--max-memory", "1.5GB"},
                                  {"--roi", "sphere:0,0,0,2"},
                                  {"--kernel", "raised_cosine"},
                                  {"--eval", "on"}});
    complete_request(command);
    const TrainRequest request = judge_form(form_);
    EXPECT_FALSE(form_.has_error()) << form_.error;
    EXPECT_EQ(request_text(request), request_text(command));
    EXPECT_EQ(form_.field(kOutputField)->usual, command.output.string());
}

TEST_F(TrainFormTest, an_error_stands_beside_its_field_and_goes_when_it_is_mended) {
    for (const auto& [name, text] : {std::pair{"--iterations", "many"},
                                     {"--max-memory", "lots"},
                                     {"--roi", "cube:1"},
                                     {"--kernel", "round"},
                                     {"--preset", "long"},
                                     {"--batch", "0"},
                                     {"--effects", "+fog"},
                                     {kDatasetField, "/no/such/folder"}}) {
        SCOPED_TRACE(name);
        const std::string before = form_.field(name)->typed;
        type(name, text);
        judge_form(form_);
        EXPECT_EQ(wrong(), std::set<std::string>{name});
        EXPECT_TRUE(form_.error.empty()) << form_.error;
        type(name, before);
        judge_form(form_);
        EXPECT_FALSE(form_.has_error());
    }
}

TEST_F(TrainFormTest, an_error_of_a_place_stands_beside_the_place) {
    judge_form(form_);
    blame_field(Error((photos_ / "images").string(), "has no photos"), form_);
    EXPECT_EQ(wrong(), std::set<std::string>{kDatasetField});
    judge_form(form_);
    blame_field(Error(form_.field(kOutputField)->usual, "cannot be written", "Name another."),
                form_);
    EXPECT_EQ(wrong(), std::set<std::string>{kOutputField});
    EXPECT_EQ(form_.field(kOutputField)->error, "This cannot be written. Name another.");
    judge_form(form_);
    blame_field(Error("device", "is lost"), form_);
    EXPECT_TRUE(wrong().empty());
    EXPECT_EQ(form_.error, "device: is lost.");
}

}  // namespace
}  // namespace darb::test
