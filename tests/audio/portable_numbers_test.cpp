// The stand-ins for functions that a platform's standard library may lack, held against this one's.

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <version>

#include <gtest/gtest.h>

#include "audio/model/bessel.h"
#include "audio/model/decimal.h"

namespace carom::test {

using namespace audio;

namespace {

#ifdef __cpp_lib_math_special_functions
TEST(BesselI0, BySeriesIsThatOfTheStandardLibrary) {
  for (double x = 0.0; x <= 50.0; x += 0.03125) {
    const double expected = std::cyl_bessel_i(0.0, x);
    EXPECT_NEAR(besselI0Series(x), expected, 2e-14 * expected) << x;
  }
}
#endif

TEST(BesselI0, IsWhatAbramowitzAndStegunTabulate) {
  // The values are from the Handbook of Mathematical Functions, table 9.8: exp(-x) I_0(x).
  EXPECT_NEAR(std::exp(-1.0) * besselI0(1.0), 0.4657596076, 5e-11);
  EXPECT_NEAR(std::exp(-5.0) * besselI0(5.0), 0.1835408126, 5e-11);
  EXPECT_NEAR(std::exp(-10.0) * besselI0Series(10.0), 0.1278333372, 5e-11);
}

#ifdef __cpp_lib_to_chars
void expectAlike(const std::string& text) {
  const char* const first = text.data();
  const char* const last = first + text.size();
  double expected = -7.0;
  double read = -7.0;
  const std::from_chars_result wanted = std::from_chars(first, last, expected);
  const std::from_chars_result got = readDecimalByStrtod(first, last, read);
  EXPECT_EQ(got.ec, wanted.ec) << '"' << text << '"';
  EXPECT_EQ(got.ptr - first, wanted.ptr - first) << '"' << text << '"';
  EXPECT_EQ(read, expected) << '"' << text << '"';
  EXPECT_EQ(std::signbit(read), std::signbit(expected)) << '"' << text << '"';
}

TEST(Decimal, ByStrtodReadsWhatFromCharsReads) {
  for (const char* text : {"",
                           "0",
                           "-0",
                           "1.5",
                           "-1.5e3",
                           "+1",
                           " 1",
                           "1 ",
                           ".5",
                           "5.",
                           ".",
                           "-",
                           "-.",
                           "1e",
                           "1e+",
                           "1e5x",
                           "0x10",
                           "1..2",
                           "--1",
                           "1e400",
                           "-1e400",
                           "1e-400",
                           "5e-324",
                           "4.9e-324",
                           "2e-320",
                           "1e-310",
                           "1,5",
                           "1e-5-3",
                           "e5",
                           "-e5",
                           "1E+05",
                           "00012",
                           "123456789012345678901234567890",
                           "0.1000000000000000055511151231257827",
                           "1.7976931348623157e308",
                           "1.7976931348623159e308",
                           "2.2250738585072014e-308"})
    expectAlike(text);
}

TEST(Decimal, ByStrtodReadsRandomTextAsFromCharsDoes) {
  std::mt19937 random(7);
  const std::string letters = "0123456789.eE+- 9";
  for (int round = 0; round < 20000; ++round) {
    std::string text;
    for (std::size_t length = random() % 12; text.size() < length;)
      text += letters[random() % letters.size()];
    expectAlike(text);
  }
}
#endif

}  // namespace
}  // namespace carom::test
