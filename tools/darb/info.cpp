#include "tools/darb/commands.h"
namespace darb {
void add_info(CLI::App&, Action&) {}
}  // namespace darb
