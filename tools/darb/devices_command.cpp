#include "tools/darb/commands.h"
namespace darb {
void add_devices(CLI::App&, Action&) {}
}  // namespace darb
