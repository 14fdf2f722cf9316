// SPDX-License-Identifier: GPL-3.0-or-later
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "core/io/files.h"

namespace lensforge {
namespace {

int open_nothing() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }
bool is_open(int number) { return ::fcntl(number, F_GETFD) >= 0; }

TEST(Descriptor, IsNeverAStandardOne) {
  const int kept = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 10);
  ::close(STDIN_FILENO);
  {
    const Descriptor file(open_nothing());
    EXPECT_GT(file.number(), STDERR_FILENO);
    EXPECT_TRUE(is_open(file.number()));
    EXPECT_FALSE(is_open(STDIN_FILENO)) << "the number itself is given back";
  }
  ::dup2(kept, STDIN_FILENO);
  ::close(kept);
}

TEST(Descriptor, ClosesItselfOnceWhereverItWent) {
  int number = -1;
  {
    Descriptor first(open_nothing());
    number = first.number();
    Descriptor second;
    EXPECT_FALSE(second.open());
    second = std::move(first);
    const Descriptor third(std::move(second));
    EXPECT_EQ(third.number(), number);
    EXPECT_TRUE(is_open(number));
  }
  EXPECT_FALSE(is_open(number));
}

TEST(Descriptor, CloseTellsTheSystemsError) {
  Descriptor file(open_nothing());
  EXPECT_EQ(file.close(), 0);
  EXPECT_EQ(file.close(), 0) << "closed already";
  Descriptor gone(open_nothing());
  ::close(gone.number());
  EXPECT_EQ(gone.close(), EBADF);
}

}  // namespace
}  // namespace lensforge
