// SPDX-License-Identifier: MIT
// Ranks: processes that work on one job together, started by mpirun or Slurm, and what they send
// each other. One interface serves builds with MPI and without (mpi.cpp, no_mpi.cpp). Nothing here
// adds numbers: the order of a sum is its caller's choice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace darb {

using Bytes = std::vector<std::byte>;

class Ranks {
  public:
    virtual ~Ranks() = default;

    /// The index of this process, from 0, and the number of processes.
    virtual int rank() const = 0;
    virtual int count() const = 0;
    bool is_first() const { return rank() == 0; }

    // All of these wait for the other ranks that take part. Where one of those ends, is stopped or
    // cannot be reached, every process ends, and one of them says which it was.

    /// Exchanges data with a partner, which must make the same call with this rank; returns what it
    /// sent.
    virtual Bytes exchange(int partner, std::span<const std::byte> bytes) = 0;
    /// Returns what every rank sent, in the order of the ranks. All ranks must call it.
    virtual std::vector<Bytes> gather(std::span<const std::byte> bytes) = 0;

    /// The bytes that this rank has sent so far, and the seconds that it spent in the two calls
    /// above.
    virtual std::uint64_t sent_bytes() const = 0;
    virtual double seconds() const = 0;

    /// Waits until all ranks have done their work: the last call.
    virtual void finish() = 0;
    /// Reports what went wrong on this rank, once and with the rank's name; then every process ends
    /// with this exit code.
    [[noreturn]] virtual void fail(const std::string& what, int exit_code) = 0;
};

/// The ranks that mpirun or Slurm started, or this process alone. From then on, only the first rank
/// prints: what the others write to stdout and stderr is lost. Throws Error where several were
/// started but this program has no MPI.
std::unique_ptr<Ranks> start_ranks();
/// The MPI that this program was built with, as text; empty: none.
std::string mpi_name();

/// Runs work() with start_ranks(). Where there are several ranks, an exception from work() ends
/// all of them: see Ranks::fail.
int with_ranks(const std::function<int(Ranks&)>& work);

/// Ranks that consist of this process alone.
class OneRank : public Ranks {
  public:
    int rank() const override { return 0; }
    int count() const override { return 1; }
    Bytes exchange(int partner, std::span<const std::byte> bytes) override;
    std::vector<Bytes> gather(std::span<const std::byte> bytes) override;
    std::uint64_t sent_bytes() const override { return 0; }
    double seconds() const override { return 0; }
    void finish() override {}
    [[noreturn]] void fail(const std::string& what, int exit_code) override;
};

/// The number of processes, as an MPI launcher tells it; 1 where none started this one.
int launched_ranks();

// For values without pointers.
template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}
/// The rank that does an item of work, where ranks take turns to and fro (0, 1, 1, 0, 0, 1, ...),
/// so that where items alternate, such as two kernels for each seed, no rank gets only one kind.
inline std::size_t turn_of(std::size_t item, std::size_t ranks) {
    const std::size_t place = item % ranks;
    return item / ranks % 2 == 0 ? place : ranks - 1 - place;
}
/// The results of all ranks in the order of the items, `each` values per item. own: those of this
/// rank's items.
template <class T>
std::vector<T> by_turns(Ranks& ranks, const std::vector<T>& own, std::size_t each = 1) {
    const std::vector<Bytes> all = ranks.gather(std::as_bytes(std::span(own)));
    std::vector<T> items;
    for (std::size_t i = 0;; ++i) {
        const Bytes& its = all[turn_of(i, all.size())];
        const std::size_t at = i / all.size() * each * sizeof(T);
        if (at + each * sizeof(T) > its.size()) return items;
        items.resize(items.size() + each);
        std::memcpy(&items[items.size() - each], its.data() + at, each * sizeof(T));
    }
}
/// Whether the item is this rank's.
inline bool has_turn(const Ranks& ranks, std::size_t item) {
    return turn_of(item, static_cast<std::size_t>(ranks.count())) ==
           static_cast<std::size_t>(ranks.rank());
}

/// Sends the first rank's value to all; for text and the like.
Bytes from_first(Ranks& ranks, std::span<const std::byte> bytes);
/// The least of the values of all ranks.
std::uint32_t least(Ranks& ranks, std::uint32_t value);

}  // namespace darb
