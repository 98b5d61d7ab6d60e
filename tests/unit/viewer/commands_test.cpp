// SPDX-License-Identifier: MIT
// The table of commands: every command once, no key twice, what keys and buttons do; and what is
// asked of a run.
#include "viewer/commands.h"

#include <gtest/gtest.h>

#include <cctype>
#include <map>
#include <set>
#include <thread>

#include "viewer/controls.h"
#include "viewer/live_picture.h"

namespace darb {
namespace {

TEST(Commands, has_every_command_once_with_words_for_it) {
    std::set<Key> seen;
    for (const Command& c : commands()) {
        EXPECT_TRUE(seen.insert(c.id).second) << c.name;
        EXPECT_EQ(&command(c.id), &c);
        EXPECT_GT(std::string(c.name).size(), 1u);
        const std::string tip = c.tip;
        EXPECT_FALSE(tip.empty() || tip.back() == '.') << c.name;
        EXPECT_TRUE(std::isupper(static_cast<unsigned char>(c.name[0]))) << c.name;
    }
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(kKeyCount));
}

TEST(Commands, no_key_has_two_commands_or_flies) {
    std::map<std::string, const char*> owner;
    for (const Command& c : commands())
        for (const char* key : c.keys) {
            if (key == nullptr) continue;
            const auto [at, is_new] = owner.emplace(key, c.name);
            EXPECT_TRUE(is_new) << key << ": " << at->second << " and " << c.name;
            EXPECT_FALSE(std::string(key).size() == 1 && kFlyKeys.find(key[0]) != kFlyKeys.npos)
                << c.name;
            EXPECT_EQ(command_of(key), c.id);
        }
    EXPECT_GT(owner.size(), 35u);
}

// Those of earlier versions.
TEST(Commands, keys_that_people_know_stay) {
    const std::map<std::string, Key> known{{"F", Key::frame_all},
                                           {"L", Key::level},
                                           {"H", Key::hide_panels},
                                           {"F11", Key::full_screen},
                                           {"P", Key::picture},
                                           {"]", Key::next_camera},
                                           {"[", Key::last_camera},
                                           {"K", Key::add_key},
                                           {"Space", Key::play},
                                           {".", Key::step},
                                           {"Ctrl+A", Key::select_all},
                                           {"Ctrl+D", Key::select_none},
                                           {"Ctrl+I", Key::select_others},
                                           {"Ctrl+H", Key::hide},
                                           {"Ctrl+U", Key::show_hidden},
                                           {"Ctrl+O", Key::open},
                                           {"Delete", Key::remove},
                                           {"Ctrl+Z", Key::undo},
                                           {"Ctrl+Y", Key::redo},
                                           {"Ctrl+S", Key::save},
                                           {"Ctrl+Q", Key::quit},
                                           {"?", Key::help},
                                           {"Esc", Key::escape},
                                           {"1", Key::tool_navigate},
                                           {"9", Key::tool_measure}};
    for (const auto& [key, id] : known) EXPECT_EQ(command_of(key), id) << key;
    EXPECT_EQ(command_of("Ctrl+Shift+Z"), Key::redo);
    EXPECT_EQ(command_of("Shift+F"), Key::frame_all)
        << "Shift changes nothing where nothing has it";
    EXPECT_EQ(command_of("Ctrl+W"), std::nullopt);
    EXPECT_EQ(command_of("Ctrl+Shift+W"), std::nullopt);
}

TEST(Commands, number_keys_choose_the_tools_in_their_order) {
    Session s;
    s.scene = std::make_unique<Scene>();
    for (int t = 0; t <= static_cast<int>(Tool::measure); ++t) {
        const std::optional<Key> key = command_of(std::to_string(t + 1));
        ASSERT_TRUE(key);
        press(*key, s);
        EXPECT_EQ(static_cast<int>(s.tools.tool), t);
        EXPECT_TRUE(command(*key).checked(s));
    }
    for (const auto& [chord, tool] : {std::pair{"Shift+3", Tool::polygon}, {"O", Tool::flood}}) {
        ASSERT_TRUE(command_of(chord)) << chord;
        press(*command_of(chord), s);
        EXPECT_EQ(s.tools.tool, tool);
    }
}

TEST(Commands, what_is_grey_does_nothing) {
    Session s;
    for (const Key id : {Key::save, Key::undo, Key::remove, Key::next_camera, Key::compare,
                         Key::tool_brush, Key::step, Key::show_error}) {
        EXPECT_FALSE(command(id).enabled(s)) << command(id).name;
        press(id, s);
    }
    EXPECT_TRUE(s.requests.empty());
    EXPECT_EQ(s.tools.tool, Tool::navigate);
    EXPECT_FALSE(s.photos.compare);
    EXPECT_EQ(s.display.mode, VIEW_COLOUR);
    press(Key::open, s);
    EXPECT_TRUE(asks_for<request::ShowOpen>(s.requests));
}

TEST(Commands, tips_name_the_keys) {
    EXPECT_EQ(keys_text(command(Key::redo)), "Ctrl+Y or Ctrl+Shift+Z");
    EXPECT_EQ(keys_text(command(Key::show_depth)), "");
    EXPECT_TRUE(command_tip(command(Key::undo)).starts_with("Undo (Ctrl+Z)\n"));
    EXPECT_TRUE(command_tip(command(Key::show_depth)).starts_with("Depth\n"));
}

TEST(Tabs, follow_what_one_works_on) {
    const Worked rest{.scene = &commands()[0]};
    EXPECT_EQ(tab_of_change(rest, rest), std::nullopt);
    Worked now = rest;
    now.tool = Tool::measure;
    EXPECT_EQ(tab_of_change(rest, now), Tab::measure);
    EXPECT_EQ(tab_of_change(now, rest), std::nullopt) << "back to orbiting";
    now = rest;
    now.selected = true;
    EXPECT_EQ(tab_of_change(rest, now), Tab::splats);
    now = rest;
    now.mesh = true;
    EXPECT_EQ(tab_of_change(rest, now), Tab::mesh);
    now = rest;
    now.camera = 3;
    EXPECT_EQ(tab_of_change(rest, now), Tab::camera);
    EXPECT_EQ(tab_of_change(now, rest), std::nullopt) << "the free camera takes over";
    EXPECT_EQ(tab_of_change(Worked(), rest), Tab::scene);
    now.run = true;
    EXPECT_EQ(tab_of_change(rest, now), Tab::training);
}

TEST(RunWishes, come_once_and_in_their_order_from_any_thread) {
    RunWishes wishes;
    EXPECT_TRUE(wishes.empty());
    constexpr int kCount = 500;
    std::thread window([&] {
        for (int i = 1; i <= kCount; ++i) wishes.ask({{.change = RunSettings{.iterations = i}}});
    });
    int last = 0;
    while (last < kCount)
        for (const RunWish& wish : wishes.take()) {
            ASSERT_TRUE(wish.change);
            EXPECT_EQ(wish.change->iterations, ++last);
        }
    window.join();
    EXPECT_TRUE(wishes.empty());
    EXPECT_TRUE(wishes.take().empty());
}

}  // namespace
}  // namespace darb
