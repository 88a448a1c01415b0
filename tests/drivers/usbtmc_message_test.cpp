#include "gonio/usbtmc_monitor/usbtmc_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "gonio/usbtmc_monitor/scpi.h"
#include "usbtmc_answer.h"

namespace gonio::usbtmc_monitor {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Optional;
using testing::ThrowsMessage;

// Laid out by hand after tables 1 to 4 of the specification.
TEST(UsbtmcMessage, OutwardOnesHaveAHeaderAndArePaddedToWholeWords) {
  EXPECT_THAT(message_out(1, "*IDN?\n"),
              ElementsAre(0x01, 0x01, 0xFE, 0x00, 0x06, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00,
                          '*', 'I', 'D', 'N', '?', '\n', 0x00, 0x00));
  EXPECT_EQ(message_out(7, "abcd").size(), 16u);
  EXPECT_EQ(message_out(7, "abcde").size(), 20u);
}

TEST(UsbtmcMessage, RequestsCarryTheMostTheyTake) {
  EXPECT_THAT(request_in(0x81, 0x01020304),
              ElementsAre(0x02, 0x81, 0x7E, 0x00, 0x04, 0x03, 0x02, 0x01, 0x00, 0x00, 0x00, 0x00));
}

TEST(UsbtmcMessage, TagsRunFrom1To255) {
  EXPECT_EQ(next_tag(0), 1);
  EXPECT_EQ(next_tag(1), 2);
  EXPECT_EQ(next_tag(255), 1);
}

TEST(UsbtmcMessage, AnswersAreTakenApart) {
  for (std::size_t padding = 0; padding < 4; ++padding) {
    const Bytes bytes = answer(9, "1.5\n", true, padding);
    const AnswerHeader header = answer_header(bytes, 100);
    EXPECT_EQ(header.tag, 9);
    EXPECT_EQ(header.size, 4u);
    EXPECT_TRUE(header.end);
    EXPECT_EQ(answer_text(bytes, header), "1.5\n");
  }
  EXPECT_FALSE(answer_header(answer(9, "1.5", false), 100).end);
}

TEST(UsbtmcMessage, AnswersThatBreakTheRulesAreRefused) {
  const Bytes good = answer(9, "1.5\n", true);
  const auto refuses = [](const Bytes& bytes, const char* words) {
    EXPECT_THAT([&] { answer_text(bytes, answer_header(bytes, 100)); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(words)));
  };
  refuses(Bytes(good.begin(), good.begin() + 11), "header of 12");
  refuses(Bytes(good.begin(), good.begin() + 14), "broke off after 14 of 16");
  refuses(answer(9, "1.5\n", true, 4), "4 bytes behind");
  refuses(answer(0, "1.5\n", true), "tag");
  refuses(answer(9, std::string(101, '1'), true), "at most 100");
  Bytes bad = good;
  bad[0] = 1;
  refuses(bad, "message id 1");
  bad = good;
  bad[2] ^= 0x10;
  refuses(bad, "inverse");
  bad = good;
  bad[7] = 0xFF;
  refuses(bad, "at most 100");
}

TEST(ScpiNumber, TakesPlainDecimalNumbers) {
  EXPECT_THAT(scpi_number("1.5"), Optional(1.5));
  EXPECT_THAT(scpi_number("+1.50000000E-03\n"), Optional(0.0015));
  EXPECT_THAT(scpi_number("-2e2\r\n"), Optional(-200.0));
  EXPECT_THAT(scpi_number(".5"), Optional(0.5));
  EXPECT_THAT(scpi_number("0"), Optional(0.0));
}

TEST(ScpiNumber, TakesNothingElse) {
  for (const char* const text :
       {"",     "\n",   "+",        "-",    ".",    "nan",  "NAN",     "inf",
        "-inf", "+inf", "1.5 W",    "1.5W", " 1.5", "1.5 ", "1.5,1.6", "1.5\n\n",
        "0x10", "1e",   "1.5\n1.6", "--1",  "+-1",  "-+1",  "1e999",   "one"}) {
    EXPECT_FALSE(scpi_number(text).has_value()) << text;
  }
}

TEST(ScpiNumber, KnowsTheNumbersThatStandForNone) {
  EXPECT_TRUE(is_out_of_range(*scpi_number("9.9E37")));
  EXPECT_TRUE(is_out_of_range(*scpi_number("-9.9E37")));
  EXPECT_TRUE(is_out_of_range(*scpi_number("9.91E37")));
  EXPECT_FALSE(is_out_of_range(1e30));
}

TEST(ScpiErrors, AreACodeAndAQuotedText) {
  const auto none = scpi_error("+0,\"No error\"\n");
  ASSERT_TRUE(none.has_value());
  EXPECT_EQ(none->code, 0);
  const auto some = scpi_error("-113,\"Undefined header\"");
  ASSERT_TRUE(some.has_value());
  EXPECT_EQ(some->code, -113);
  EXPECT_EQ(some->message, "Undefined header");
  for (const char* const text : {"", "0", "x,\"y\"", "1,y", "1,\"", ",\"y\"", "1.5,\"y\""}) {
    EXPECT_FALSE(scpi_error(text).has_value()) << text;
  }
}

TEST(ScpiErrors, TextForPeopleIsPrintableAndShort) {
  EXPECT_EQ(printable("a\tb\x1B[0m\n"), "a?b?[0m");
  EXPECT_EQ(printable(std::string(200, 'x')).size(), 60u);
}

}  // namespace
}  // namespace gonio::usbtmc_monitor
