#include "tools/darb/commands.h"
namespace darb {
void add_render(CLI::App&, Action&) {}
}  // namespace darb
