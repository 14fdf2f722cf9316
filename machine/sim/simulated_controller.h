// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "machine/sim/sim_firmware.h"
#include "machine/sim/sim_gcode.h"
#include "machine/sim/sim_queue.h"

namespace lensforge {

/// Output of the controller and its time.
struct Spoken {
  double time = 0.0;
  std::string text;
};

/// A Grbl 1.1 or grblHAL controller and its mill, in virtual time: receive buffer, realtime
/// commands, line parser, planner, motion, alarms and reports, as documented for Grbl 1.1 and
/// grblHAL. Memory does not grow with the program.
///
/// Its decisions are pure functions: sim_firmware.h (bytes to lines, machine states, reports) and
/// sim_gcode.h (lines to actions). This class carries them out.
///
/// It tracks the mill's true position as well as the controller's: a reset in motion, a hard stop
/// or a power cycle makes the two differ until the next homing.
class SimulatedController {
 public:
  explicit SimulatedController(const SimulatedOptions& options, const MachineWatch& watch = {});
  SimulatedController(const SimulatedController&) = delete;
  SimulatedController& operator=(const SimulatedController&) = delete;

  /// A byte arrives.
  void receive(char byte);
  /// Takes the output since the last call.
  std::vector<Spoken> take_output();
  /// Lets time pass up to `time` or the next output.
  /// @return now().
  double run_until(double time);
  [[nodiscard]] double now() const { return now_; }

  // What happens to it from outside.
  void power_cycle();
  void soft_reset();
  void feed_hold();
  void cycle_start();
  void move_door(bool open);
  /// Raises alarm `code`: 1 and 2 as limits do, others as the firmware does.
  void raise_alarm(int code);
  /// The next G-code line is answered with this error and not run.
  void fail_next_line(int error) { scripted_error_ = error; }
  /// The next homing ends in alarm 8 or 9.
  void fail_next_homing(int alarm) { scripted_homing_ = alarm; }
  /// The next bytes find the receive buffer full.
  void lose_bytes(int count) { losing_ = count; }

  // Observers.
  [[nodiscard]] MachineState state() const { return machine_.state; }
  /// "Run", "Hold:0"
  [[nodiscard]] std::string state_text() const { return sim_state::text(machine_, is_hal(), now_); }
  [[nodiscard]] Eigen::Vector3d position() const {
    return queue_.position();
  }  ///< According to the controller.
  [[nodiscard]] Eigen::Vector3d true_position() const { return queue_.position() + slip_; }
  [[nodiscard]] bool moving() const { return sim_state::moving(machine_, motion()); }
  [[nodiscard]] int spindle() const { return queue_.spindle; }
  [[nodiscard]] double rpm() const { return queue_.rpm; }
  [[nodiscard]] bool homed() const { return machine_.homed; }
  [[nodiscard]] std::int64_t received_lines() const { return received_; }
  [[nodiscard]] std::int64_t lost_bytes() const { return lost_; }
  [[nodiscard]] const SimSettings& settings() const { return settings_; }
  /// Sets G54 … G59 (0 … 5), as an operator does before a job.
  void set_origin(int index, const Eigen::Vector3d& origin) { gcode_.set_origin(index, origin); }

 private:
  /// A line in progress: its remaining work and its answer.
  struct Errand {
    std::deque<SimAction> actions;
    int chord = 0;  ///< Next chord of the first action's arc to queue.
    bool answer = false;
    std::int64_t received = 0;
  };

  // Time and state.
  void power_up();
  void restart();
  void work();
  bool settle();
  void begin_motion();
  void resume();
  void stop_for(MachineState state);
  void finish_stop();
  void finish_homing();
  void lose_steps();
  void set_spindle(int turn, double rpm);
  void set_overrides(const SimOverrides& overrides);
  void acknowledge_tool();
  void leave_tool();
  [[nodiscard]] bool is_hal() const { return options_.firmware == SimulatedFirmware::kGrblHal; }
  [[nodiscard]] SimMotion motion() const {
    return {queue_.empty(), queue_.holding(), queue_.stands()};
  }
  void event(const std::string& what);
  void say(const std::string& text) { output_.push_back({now_, text}); }

  // Bytes from the wire.
  bool realtime(unsigned char byte);
  void hal_command(unsigned char byte);
  void open_and_shut_door();
  void cancel_jog();
  void report();
  [[nodiscard]] SimSnapshot snapshot() const;

  // Lines.
  bool step_parser();
  bool read_characters();
  void run_line();
  int run_gcode(const std::string& line);
  bool run_action();
  void carry_out(const SimAction& action);
  void end_program();
  bool queue_move(const SimAction& action);
  void wait(double seconds);
  void run_startup_lines();
  [[nodiscard]] bool beyond_travel(const Eigen::Vector3d& target) const;
  void answer(int error);

  // `$` commands.
  int run_system(const std::string& line);
  int print_settings();
  int toggle_check();
  int unlock();
  int jog(const std::string& line);
  int idle_system(const std::string& line);
  int home();
  int sleep();
  int restore(const std::string& line);
  int startup_lines(const std::string& line);
  int write_setting(const std::string& line);
  void store();
  void print_build();

  const SimulatedOptions options_;
  const MachineWatch watch_;
  SimSettings settings_;
  SimQueue queue_;
  SimGcode gcode_;
  double now_ = 0.0;
  std::vector<Spoken> output_;

  SimState machine_;
  int coolant_ = 0;
  Eigen::Vector3d slip_ = Eigen::Vector3d::Zero();  ///< True position − believed position.
  SimOverrides overrides_;
  SimCountdowns countdowns_;

  SimBuffer rx_;
  SimIntake intake_;
  bool line_waits_ = false;  ///< A complete line is being processed until busy_until_.
  Errand errand_;
  Errand saved_errand_;  ///< The tool change while other lines run.
  std::string saved_rx_;
  bool reset_after_answer_ = false;
  double busy_until_ = 0.0;
  double deaf_until_ = 0.0;
  int last_error_ = 0;
  std::int64_t received_ = 0;

  // What happens to it from outside.
  int scripted_error_ = 0;
  int scripted_homing_ = 0;
  int losing_ = 0;
  std::int64_t lost_ = 0;
  bool losing_now_ = false;
};

}  // namespace lensforge
