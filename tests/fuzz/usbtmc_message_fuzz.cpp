// Transfers of a USBTMC instrument and the SCPI answers in them.

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "gonio/usbtmc_monitor/scpi.h"
#include "gonio/usbtmc_monitor/usbtmc_message.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gonio::usbtmc_monitor;
  const std::span<const std::uint8_t> transfer(data, size);
  std::string text(transfer.begin(), transfer.end());
  try {
    const AnswerHeader header = answer_header(transfer, 1024);
    text = answer_text(transfer, header);
    if (text.size() != header.size) std::abort();
  } catch (const std::invalid_argument&) {
  }
  const auto number = scpi_number(text);
  if (number && !std::isfinite(*number)) std::abort();
  const auto error = scpi_error(text);
  if (error && error->message.size() > 60) std::abort();
  if (printable(text).size() > 60) std::abort();
  return 0;
}
