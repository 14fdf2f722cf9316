// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <random>

#include "core/error.h"
#include "core/lens/smooth_surface.h"
#include "core/temp_folder.h"
#include "export/sample_surfaces.h"
#include "export/solid/solid_files.h"
#include "export/solid/solid_reading.h"
#include "export/spline/spline_fit.h"

// Files of solids that are broken in one place, each read in this process: OpenCASCADE crashes at
// every fourth of them, which must be an InputError here. LENSFORGE_CAMPAIGN says how many of each
// kind.
namespace lensforge::testing {
namespace {

namespace fs = std::filesystem;

int mutants() {
  const char* asked = std::getenv("LENSFORGE_CAMPAIGN");
  return asked != nullptr ? std::atoi(asked) : 30;
}

/// A place where a number or a reference (#12) begins, and where it ends.
struct Word {
  std::size_t begin = 0;
  std::size_t end = 0;
};

class Mutator {
 public:
  explicit Mutator(std::string whole) : whole_(std::move(whole)) {
    for (std::size_t at = 0; at < whole_.size(); ++at) {
      if (at == 0 || whole_[at - 1] == '\n') lines_.push_back(at);
      const bool digit = std::isdigit(static_cast<unsigned char>(whole_[at])) != 0;
      if (!digit || (at > 0 && is_part(whole_[at - 1]))) continue;
      const auto end =
          std::find_if_not(whole_.begin() + static_cast<std::ptrdiff_t>(at), whole_.end(), is_part);
      numbers_.push_back({at, static_cast<std::size_t>(end - whole_.begin())});
    }
  }

  [[nodiscard]] std::string mutant(std::uint32_t seed) const {
    std::mt19937 random(seed);
    switch (seed % 6) {
      case 0:
        return without(line(random));
      case 1: {
        const Word word = line(random);
        return replaced({word.end, word.end}, text(word));
      }
      case 2:
        return replaced(line(random), text(line(random)));
      case 3:
        return replaced(number(random), text(number(random)));
      case 4: {
        static const std::vector<std::string> kAbsurd{
            "1e400", "-1", "0", "NaN", "1e30", "99999", "$", "''", "()", "-0.", "*", "2147483647"};
        return replaced(number(random), kAbsurd[random() % kAbsurd.size()]);
      }
      default:
        return whole_.substr(0, random() % whole_.size());
    }
  }

 private:
  static bool is_part(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '+';
  }
  [[nodiscard]] std::string text(const Word& word) const {
    return whole_.substr(word.begin, word.end - word.begin);
  }
  [[nodiscard]] std::string replaced(const Word& word, const std::string& by) const {
    return std::string(whole_).replace(word.begin, word.end - word.begin, by);
  }
  [[nodiscard]] std::string without(const Word& word) const { return replaced(word, ""); }
  [[nodiscard]] Word line(std::mt19937& random) const {
    const std::size_t i = random() % lines_.size();
    return {lines_[i], i + 1 < lines_.size() ? lines_[i + 1] : whole_.size()};
  }
  [[nodiscard]] Word number(std::mt19937& random) const {
    return numbers_[random() % numbers_.size()];
  }

  std::string whole_;
  std::vector<std::size_t> lines_;
  std::vector<Word> numbers_;
};

class SolidMutants : public ::testing::Test {
 protected:
  static SplineNet small_net() {
    FitOptions options;
    options.max_control_points = 64;
    return fit_spline_net(SmoothSurface(smooth_lens(11)), options, Executor::serial(),
                          RunControl());
  }

  /// @param read  must end, with InputError at most.
  void expect_survived(const std::function<void()>& read) {
    const std::string whole = read_bytes(path_);
    const Mutator mutator(whole);
    for (std::uint32_t seed = 0; seed < static_cast<std::uint32_t>(mutants()); ++seed) {
      write_bytes(path_, mutator.mutant(seed));
      try {
        read();
        ++read_;
      } catch (const InputError& refusal) {
        EXPECT_THAT(refusal.what(), ::testing::HasSubstr(path_.filename().string())) << seed;
        ++refused_;
        if (std::string(refusal.what()).find("crashed") != std::string::npos) ++crashed_;
      }
    }
    RecordProperty("read", read_);
    RecordProperty("refused", refused_);
    RecordProperty("crashed", crashed_);
    EXPECT_GT(refused_, 0);
  }

  TempFolder folder_;
  fs::path path_;
  int read_ = 0;
  int refused_ = 0;
  int crashed_ = 0;
};

const StepHeader kHeader{"lens", "", "", "lensforge 9", "2020-02-02T02:02:02"};

TEST_F(SolidMutants, OfStepAreReadOrRefused) {
  path_ = folder_ / "mutant.step";
  write_step(small_net(), kHeader, StepSchema::kAp214, path_);
  expect_survived([&] { read_solid_surface(path_, 500, Executor::serial()); });
}

TEST_F(SolidMutants, OfIgesAreReadOrRefused) {
  path_ = folder_ / "mutant.igs";
  write_iges(small_net(), kHeader, path_);
  expect_survived([&] { inspect_iges(path_); });
}

}  // namespace
}  // namespace lensforge::testing
