#include "gonio/samples/csv.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cmath>
#include <random>

#include "gonio/errors/errors.h"
#include "scratch_folder.h"

namespace gonio::samples {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Csv : public test::ScratchFolder {
 protected:
  std::string fault(std::string_view text) {
    const auto path = written(text);
    return error_of<DataFormatError>([&] {
      CsvReader reader(path);
      while (const auto row = reader.next()) reader.number(*row, 0);
    });
  }
};

TEST_F(Csv, ReadsQuotesBlanksCommentsAndWindowsLines) {
  const auto path = written(
      "\xEF\xBB\xBF# made by hand\r\n a , \"b, or c\",d\r\n\r\n1, \"say \"\"x\"\"\" ,\r\n# "
      "end\n2,,z");
  CsvReader reader(path);
  EXPECT_THAT(reader.header(), ElementsAre("a", "b, or c", "d"));
  EXPECT_EQ(reader.header_line(), 2);
  EXPECT_EQ(reader.column("d"), 2u);
  EXPECT_FALSE(reader.column("e").has_value());
  const auto first = reader.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->line, 4);
  EXPECT_THAT(first->cells, ElementsAre("1", "say \"x\"", ""));
  const auto second = reader.next();
  ASSERT_TRUE(second);
  EXPECT_THAT(second->cells, ElementsAre("2", "", "z"));
  EXPECT_FALSE(reader.next());
  ASSERT_EQ(reader.comments().size(), 2u);
  EXPECT_EQ(reader.comments()[1].text, "end");
  EXPECT_EQ(reader.comments()[1].line, 5);
}

TEST_F(Csv, NamesLineColumnFoundAndExpectedForABadNumber) {
  EXPECT_THAT(fault("a,b\n1,2\n1.5x,2\n"),
              HasSubstr("in.csv: line 3, column a: found '1.5x', expected a finite number"));
}

TEST_F(Csv, RefusesNumbersThatAreNotFiniteOrNotThere) {
  for (const char* cell : {"nan", "inf", "-inf", "1e999", "", "0x10", "1 2", "+1", "1;5"}) {
    const auto path = written("a,b\n" + std::string(cell) + ",0\n");
    CsvReader reader(path);
    const auto row = reader.next();
    ASSERT_TRUE(row);
    EXPECT_THROW(reader.number(*row, 0), DataFormatError) << cell;
  }
}

TEST_F(Csv, RefusesARowOfAnotherLength) {
  EXPECT_THAT(fault("a,b\n1\n"), HasSubstr("line 2: found 1 cells, expected 2"));
  EXPECT_THAT(fault("a,b\n1,2,\n"), HasSubstr("line 2: found 3 cells, expected 2"));
}

TEST_F(Csv, RefusesHostileBytes) {
  using namespace std::string_view_literals;
  EXPECT_THAT(fault("a,b\n1,2\0\n"sv), HasSubstr("line 2: found control character 0 at byte 4"));
  EXPECT_THAT(fault("a,b\n1,\x1b[31m\n"), HasSubstr("control character 27"));
  EXPECT_THAT(fault("a,b\n1,\"open\n"), HasSubstr("line 2: found an open double quote"));
  EXPECT_THAT(fault("a,b\n1,\"x\"y\n"), HasSubstr("after a closing double quote"));
  EXPECT_THAT(fault("a,b\n" + std::string(70000, '1') + ",2\n"), HasSubstr("longer than 64 KiB"));
  EXPECT_THAT(fault(std::string(2000, ',') + "\n"), HasSubstr("more than 1024 columns"));
}

TEST_F(Csv, ShortensALongBadCellInTheMessage) {
  const std::string message = fault("a,b\n" + std::string(5000, 'x') + ",2\n");
  EXPECT_LT(message.size(), 300u);
}

TEST_F(Csv, RefusesEmptyFilesAndUnusableHeaders) {
  EXPECT_THAT(fault(""), HasSubstr("found no header line"));
  EXPECT_THAT(fault("# only a comment\n"), HasSubstr("found no header line"));
  EXPECT_THAT(fault("a,a\n"), HasSubstr("line 1, column a: found twice"));
  EXPECT_THAT(fault("a,,c\n"), HasSubstr("found no name for column 2"));
}

TEST_F(Csv, RefusesWhatIsNoPlainFile) {
  EXPECT_THAT(error_of<FileError>([&] { CsvReader reader(file("absent.csv")); }),
              HasSubstr("No such file"));
  EXPECT_THROW(CsvReader{std::filesystem::temp_directory_path()}, FileError);
  EXPECT_THROW(CsvReader{"/dev/zero"}, FileError);
  const auto pipe = file("pipe.csv");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);  // nobody will ever write to it
  EXPECT_THROW(CsvReader{pipe}, FileError);
}

TEST_F(Csv, ChecksWholeNumbersAndRanges) {
  const auto path = written("a,b\n3.5,7\n");
  CsvReader reader(path);
  const auto row = reader.next();
  ASSERT_TRUE(row);
  EXPECT_EQ(reader.integer_within(*row, 1, 0, 7), 7);
  EXPECT_THROW(reader.integer_within(*row, 1, 0, 6), DataFormatError);
  EXPECT_THROW(reader.integer_within(*row, 0, 0, 9), DataFormatError);
  EXPECT_EQ(reader.number_within(*row, 0, 0.0, 3.5), 3.5);
  EXPECT_THAT(error_of<DataFormatError>([&] { reader.number_within(*row, 0, 0.0, 3.0); }),
              HasSubstr("found '3.5', expected 0 to 3"));
}

TEST(CsvText, WritesRoundDegreesAsRoundNumbers) {
  for (int i = -1800; i <= 1800; ++i) {
    const double degrees = i / 10.0;
    EXPECT_EQ(csv_degrees(Angle::from_degrees(degrees)), csv_number(degrees));
  }
}

TEST(CsvText, KeepsEveryBitOfAnglesThatCameFromDegrees) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> uniform(-180.0, 180.0);
  for (int i = 0; i < 20000; ++i) {
    const Angle angle = Angle::from_degrees(uniform(generator));
    EXPECT_EQ(Angle::from_degrees(std::stod(csv_degrees(angle))), angle);
  }
}

TEST(CsvText, WritesShortestNumbers) {
  EXPECT_EQ(csv_number(0.1), "0.1");
  EXPECT_EQ(csv_number(1e-300), "1e-300");
  EXPECT_THROW(csv_number(NAN), std::invalid_argument);
  EXPECT_THROW(csv_degrees(Angle::from_radians(INFINITY)), std::invalid_argument);
}

TEST(CsvText, QuotesOnlyWhatNeedsIt) {
  EXPECT_EQ(csv_cell("dark;clipped"), "dark;clipped");
  EXPECT_EQ(csv_cell("a,b"), "\"a,b\"");
  EXPECT_EQ(csv_cell("say \"x\""), "\"say \"\"x\"\"\"");
  EXPECT_EQ(csv_cell("#1"), "\"#1\"");
  EXPECT_EQ(csv_cell(" x"), "\" x\"");
  EXPECT_THROW(csv_cell("two\nlines"), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::samples
