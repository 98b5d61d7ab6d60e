// SPDX-License-Identifier: MIT
#include "engine/core/system_files.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <span>
#include <string>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

class SystemFiles : public testing::Test {
  protected:
    ~SystemFiles() override {
        std::error_code none;
        fs::remove_all(folder_, none);
    }
    fs::path write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
        return folder_ / name;
    }
    static bool append(File& file, const std::string& text) {
        return file.write(std::as_bytes(std::span(text)));
    }
    const fs::path folder_ = make_scratch_folder("darb_system_files");
};

TEST_F(SystemFiles, two_names_of_one_file_have_one_number_and_two_files_have_two) {
    const fs::path one = write("one", "1"), two = write("two", "2");
    fs::create_hard_link(one, folder_ / "link");
    const FileFacts facts = file_facts(one);
    EXPECT_EQ(facts.kind, FileKind::regular);
    EXPECT_EQ(facts.bytes, 1u);
    EXPECT_EQ(facts.id, file_facts(folder_ / "link").id);
    EXPECT_EQ(facts.id, File(folder_ / "link", File::Open::read).facts().id);
    EXPECT_NE(facts.id, file_facts(two).id);
    EXPECT_EQ(file_facts(folder_).kind, FileKind::folder);
    EXPECT_EQ(file_facts(folder_ / "none").kind, FileKind::none);
}

TEST_F(SystemFiles, a_change_shows_in_the_time_or_the_size) {
    const fs::path file = write("file", "text");
    const FileFacts before = file_facts(file);
    EXPECT_EQ(before.changed_ns, file_facts(file).changed_ns);
    std::error_code none;
    fs::last_write_time(file, fs::last_write_time(file) + std::chrono::seconds(10), none);
    if (none == std::errc::function_not_supported) GTEST_SKIP() << "times cannot be set here";
    const double later_s = 1e-9 * double(file_facts(file).changed_ns - before.changed_ns);
    EXPECT_NEAR(later_s, 9, 1.001);  // some systems set whole seconds
}

TEST_F(SystemFiles, make_refuses_what_is_there_and_says_so) {
    const File file(write("file", ""), File::Open::make);
    EXPECT_FALSE(file.is_open());
    EXPECT_EQ(file.error(), std::errc::file_exists);
    const File none(folder_ / "none" / "file", File::Open::make);
    EXPECT_EQ(none.error(), std::errc::no_such_file_or_directory);
    EXPECT_EQ(File(folder_ / "none", File::Open::append_own).error(),
              std::errc::no_such_file_or_directory);
}

TEST_F(SystemFiles, appending_twice_keeps_both_and_head_reads_from_the_start) {
    const fs::path file = folder_ / "log";
    for (const char* text : {"one\n", "two\r\n"}) {
        File log(file, File::Open::append);
        EXPECT_TRUE(append(log, text)) << log.error().message();
    }
    EXPECT_EQ(read_text_file(file), "one\ntwo\r\n");
    File lock(file, File::Open::lock);
    EXPECT_EQ(lock.head(3), "one");
    EXPECT_TRUE(lock.replace_content("new"));
    EXPECT_EQ(lock.head(100), "new");
    EXPECT_EQ(read_text_file(file), "new");
}

// Two openings of a file count as two holders, as two processes do.
TEST_F(SystemFiles, a_lock_is_held_by_one_and_others_can_read_what_is_locked) {
    const fs::path file = write("lock", "held");
    File first(file, File::Open::lock), second(file, File::Open::lock);
    EXPECT_TRUE(first.lock());
    EXPECT_FALSE(second.lock());
    EXPECT_EQ(second.head(10), "held");
    EXPECT_EQ(read_text_file(file), "held");
    first.close();
    EXPECT_TRUE(second.lock());
}

TEST_F(SystemFiles, a_file_takes_the_place_of_another_that_somebody_reads) {
    const fs::path from = write("from", "new"), to = write("to", "old");
    File reader(to, File::Open::read);
    std::error_code failed = replace_file(from, to);
    reader.close();
#ifdef _WIN32  // it may refuse as long as somebody reads, and then nothing has changed
    if (failed) {
        EXPECT_EQ(failed, std::errc::permission_denied);
        EXPECT_EQ(read_text_file(to), "old");
        failed = replace_file(from, to);
    }
#endif
    EXPECT_FALSE(failed) << failed.message();
    EXPECT_EQ(read_text_file(to), "new");
    EXPECT_FALSE(fs::exists(from));
    EXPECT_EQ(replace_file(folder_ / "none", to), std::errc::no_such_file_or_directory);
    EXPECT_EQ(read_text_file(to), "new");
}

TEST_F(SystemFiles, a_moved_file_is_closed_once) {
    File first(folder_ / "file", File::Open::make);
    File second = std::move(first);
    EXPECT_FALSE(first.is_open());
    EXPECT_TRUE(append(second, "text"));
    first = std::move(second);
    EXPECT_TRUE(append(first, " more"));
    first.close();
    EXPECT_EQ(read_text_file(folder_ / "file"), "text more");
}

TEST_F(SystemFiles, names_of_any_letters_and_of_any_length_can_be_written_and_read) {
    fs::path folder = folder_ / fs::path(u8"Z\u00fcrich \u65e5\u672c \U0001f600");
    for (int i = 0; i < 6; ++i) folder /= std::string(50, char('a' + i));
    ASSERT_GT(folder.native().size(), 260u);
    const fs::path file = folder / fs::path(u8"\u540d\u524d.txt");
    write_file_atomic(file, std::string_view("first"));
    write_file_atomic(file, std::string_view("second"));
    EXPECT_EQ(read_text_file(file), "second");
    EXPECT_EQ(file_facts(file).bytes, 6u);
    // What the command line gives, UTF-8 in a narrow string, is the same name.
    EXPECT_EQ(read_text_file(file.string()), "second");
    EXPECT_EQ(fs::path(file.string()), file);
}

TEST_F(SystemFiles, scratch_folders_differ) {
    const fs::path other = make_scratch_folder("darb_system_files");
    EXPECT_NE(other, folder_);
    EXPECT_TRUE(fs::is_empty(other));
    fs::remove(other);
}

TEST(DeviceNames, are_those_of_windows_with_any_extension_and_in_any_case) {
    for (const char* name : {"con", "CON", "aux.ply", "Prn.tar.gz", "com1", "LPT9.png", "conin$"})
        EXPECT_TRUE(is_device_name(name)) << name;
    for (const char* name : {"", "cone", "com", "com0", "com10", "scene.con", "auxiliary", "nul"})
        EXPECT_FALSE(is_device_name(name)) << name;
}

TEST_F(SystemFiles, device_names_are_refused_where_the_system_keeps_them) {
    const fs::path file = folder_ / "aux.txt";
#ifdef _WIN32
    EXPECT_THROW(write_file_atomic(file, std::string_view("text")), Error);
    EXPECT_THROW(read_text_file(file), Error);
#else
    write_file_atomic(file, std::string_view("text"));
    EXPECT_EQ(read_text_file(file), "text");
#endif
}

}  // namespace
}  // namespace darb
