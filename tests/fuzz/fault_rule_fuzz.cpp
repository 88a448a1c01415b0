// Rules of faults as a command line writes them.

#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include "gonio/emulator_faults/fault_plan.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gonio::emulator_faults;
  try {
    const FaultRule rule =
        fault_rule_from_text(std::string_view(reinterpret_cast<const char*>(data), size));
    if (!(rule.after_s >= 0.0) || !(rule.probability >= 0.0 && rule.probability <= 1.0)) {
      std::abort();
    }
    FaultPlan plan({rule});
    plan.strikes(rule.fault, rule.device, std::chrono::seconds(1));
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
