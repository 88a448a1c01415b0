#pragma once

#include <optional>
#include <string>
#include <string_view>

/// Answers of SCPI instruments, read strictly.
///
/// Source   IEEE 488.2-1992, 8.7.2 to 8.7.4 (numeric response data); SCPI-99, volume 1, 7.2.1
///          (numbers that are none) and volume 2, 21.8 (error queue).
namespace gonio::usbtmc_monitor {

/// One decimal number and nothing else but the line's end. Nothing for anything else, also for
/// "nan", "inf", hexadecimal, spaces, units, lists and values no double can hold.
std::optional<double> scpi_number(std::string_view text);

/// From here on (9.9E37) a number stands for "infinite" or "not a number": the instrument is out of
/// its range.
bool is_out_of_range(double value);

struct ScpiError {
  int code = 0;  ///< 0: none
  std::string message;
};
/// An answer to SYST:ERR?: -113,"Undefined header". Nothing for anything else.
std::optional<ScpiError> scpi_error(std::string_view text);

/// For messages: at most 60 characters, what cannot be printed as '?', without the line's end.
std::string printable(std::string_view text);

}  // namespace gonio::usbtmc_monitor
