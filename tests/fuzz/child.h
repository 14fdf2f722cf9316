// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

/// The command as a process of its own, without the 0.3 s that starting one takes.
namespace lensforge::fuzz {

using Arguments = std::vector<std::string>;

/// Initial kind of a descriptor of the command.
enum class Stream {
  kUsual,   ///< Input /dev/null; output and errors a file that is kept.
  kClosed,  ///< Not open at all.
  kFull,    ///< /dev/full.
  kBroken,  ///< A pipe that nobody reads, or that ends at once.
};

/// One command and the world that it finds.
struct Command {
  Arguments arguments;  ///< Without the program's name.
  Stream in = Stream::kUsual;
  Stream out = Stream::kUsual;
  Stream err = Stream::kUsual;
  unsigned long file_size_limit = 0;  ///< RLIMIT_FSIZE, bytes; 0: kMaxFile.
  bool exec = false;                  ///< Starts the built command instead of forking it.
  bool json_by_config = false;        ///< A --config file asks for JSON.
};

/// Address space of a command.
inline constexpr unsigned long kMaxMemory = 4UL << 30U;
/// Bytes of one file: nothing in a campaign is near it but what got out of hand.
inline constexpr unsigned long kMaxFile = 1UL << 28U;

/// A command's end.
struct Ending {
  int exit_code = -1;   ///< −1 if a signal ended it.
  int signal = 0;       ///< Which one; 0 for none.
  int asked = 0;        ///< Signal that was sent to it; 0 for none.
  bool killed = false;  ///< It did not heed it.
  double seconds = 0.0;
  double stop_seconds = -1.0;  ///< From the signal to the end; −1 without one.
  std::string out;
  std::string err;
};

/// A running command; killed with all its children when this object goes.
class Child {
 public:
  /// Starts it in `folder`; its output is kept in `record`.out and .err.
  Child(const Command& command, const std::filesystem::path& folder, std::filesystem::path record);
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Waits; after `budget` seconds it sends `signal` and then waits kMaxStop for the end.
  Ending wait(double budget, int signal);

 private:
  bool ended_within(double seconds);
  [[nodiscard]] double age() const;

  std::filesystem::path record_;
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Seconds from a signal to the end; the commands' own goal is 1.
inline constexpr double kMaxStop = 5.0;

/// Seconds that a command may take to prepare something; sanitizers slow it down several times.
#ifdef __SANITIZE_ADDRESS__
inline constexpr double kMaxPreparation = 600.0;
#else
inline constexpr double kMaxPreparation = 60.0;
#endif

/// Start to end, kMaxPreparation at most.
Ending run_to_end(const Command& command, const std::filesystem::path& folder,
                  const std::filesystem::path& record);

std::string file_content(const std::filesystem::path& file);

}  // namespace lensforge::fuzz
