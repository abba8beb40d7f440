#pragma once

#include <cerrno>
#include <charconv>
#include <clocale>
#include <cstdlib>
#include <string>
#include <system_error>

namespace carom::audio {

/// Returns the end of the characters from `first` on that have the form of a finite number which
/// std::from_chars takes: digits with at most one point among them, before them no sign but a
/// minus, behind them perhaps an exponent. `first` if there is no number.
inline const char* endOfDecimal(const char* first, const char* last) {
  const auto digits = [last](const char* at) {
    while (at != last && *at >= '0' && *at <= '9')
      ++at;
    return at;
  };
  const char* const begin = first != last && *first == '-' ? first + 1 : first;
  const char* const whole = digits(begin);
  const bool hasPoint = whole != last && *whole == '.';
  const char* const mantissa = hasPoint ? digits(whole + 1) : whole;
  if (mantissa - begin == (hasPoint ? 1 : 0)) return first;  // no digit at all
  if (mantissa == last || (*mantissa != 'e' && *mantissa != 'E')) return mantissa;
  const char* sign = mantissa + 1;
  if (sign != last && (*sign == '+' || *sign == '-')) ++sign;
  const char* const exponent = digits(sign);
  return exponent == sign ? mantissa : exponent;
}

/// Reads a finite number as std::from_chars would, by strtod in the C locale.
inline std::from_chars_result readDecimalByStrtod(const char* first, const char* last,
                                                  double& value) {
  const char* const end = endOfDecimal(first, last);
  if (end == first) return {first, std::errc::invalid_argument};
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", nullptr);
  const std::string text(first, end);
  errno = 0;
  const double read = strtod_l(text.c_str(), nullptr, plain);
  // strtod reports subnormal numbers as out of range, although they are only inexact.
  const bool isBeyond = errno == ERANGE && (read == 0.0 || read > 1.0 || read < -1.0);
  if (isBeyond) return {end, std::errc::result_out_of_range};
  value = read;
  return {end, std::errc()};
}

/// Reads a double as std::from_chars does. Where the standard library has that for integers alone
/// (libc++ up to 19), finite numbers are read alike; infinities and NaNs by name are no numbers
/// there. [any thread]
inline std::from_chars_result readDecimal(const char* first, const char* last, double& value) {
#ifdef __cpp_lib_to_chars
  return std::from_chars(first, last, value);
#else
  return readDecimalByStrtod(first, last, value);
#endif
}

}  // namespace carom::audio
