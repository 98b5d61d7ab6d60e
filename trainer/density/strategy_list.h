// The table of the strategies of density control, and the only switch between them. A row is a
// name: trainer/density/<name>.cpp defines `const StrategyRow& <name>_row()`, all that is known of
// it. The first row is the default.
#pragma once

#define DARB_STRATEGIES(ROW) \
    ROW(adc)                 \
    ROW(mcmc)                \
    ROW(budget)

namespace darb {

/// How the splats grow in number; see trainer/strategy.h.
enum class Strategy {
#define DARB_STRATEGY(name) name,
    DARB_STRATEGIES(DARB_STRATEGY)
#undef DARB_STRATEGY
};

}  // namespace darb
