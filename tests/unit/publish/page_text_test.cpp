// SPDX-License-Identifier: MIT
#include "engine/publish/page_document.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/publish/page_files.h"

namespace darb {
namespace {

TEST(ScriptJson, text_that_would_end_a_script_is_escaped) {
    const std::string name =
        "</script><script>alert(1)</script><!-- \" ' \\ \n\r\t & \xe2\x80\xae\xe2\x80\xa8 \x01";
    const std::string json = script_json({{"name", name}});
    for (const char c : json) EXPECT_TRUE(c >= 0x20 && c < 0x7f && c != '<' && c != '>') << json;
    EXPECT_EQ(nlohmann::json::parse(json)["name"].get<std::string>(), name);
}

TEST(ScriptJson, bytes_that_are_no_utf8_become_replacement_characters) {
    EXPECT_EQ(script_json("a\xff\xc0z"), "\"a\\ufffd\\ufffdz\"");
}

TEST(WithoutCommentLines, comments_indentation_and_blank_lines_go) {
    EXPECT_EQ(without_comment_lines("// one\n\n  a = 1;  // kept\n\t// two\nb"),
              "a = 1;  // kept\nb\n");
}

TEST(PageFiles, each_is_there_and_whole) {
    std::size_t count = 0;
    for (const PageFile* file = kPageFiles; !file->name.empty(); ++file, ++count) {
        EXPECT_EQ(page_file(file->name).data(), file->text.data());
        EXPECT_FALSE(file->text.empty()) << file->name;
    }
    EXPECT_GE(count, 1u);
}

}  // namespace
}  // namespace darb
