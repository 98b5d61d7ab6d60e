// Ranks: the processes that work on one thing together, started by mpirun or Slurm, and what they
// send each other. Built with MPI or without (mpi.cpp, no_mpi.cpp): one interface. Nothing here
// adds numbers: an order of sums is its caller's.
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

    /// This process, from 0, and how many there are.
    virtual int rank() const = 0;
    virtual int count() const = 0;
    bool is_first() const { return rank() == 0; }

    // All wait for the other ranks that take part. Where one of these ends, is stopped or cannot be
    // reached, every process ends, and one of them says which it was.

    /// To a partner, which does the same with this rank: what it gave.
    virtual Bytes exchange(int partner, std::span<const std::byte> bytes) = 0;
    /// What every rank gave, in their order. All ranks call it.
    virtual std::vector<Bytes> gather(std::span<const std::byte> bytes) = 0;

    /// Bytes that this rank has sent so far, and the seconds that it spent in the two above.
    virtual std::uint64_t sent_bytes() const = 0;
    virtual double seconds() const = 0;

    /// All ranks have done their work: the last call.
    virtual void finish() = 0;
    /// What went wrong on this rank, for people: it is said once, with the rank's name, and every
    /// process ends with this exit code.
    [[noreturn]] virtual void fail(const std::string& what, int exit_code) = 0;
};

/// The ranks that mpirun or Slurm started, or this process alone. From then on only the first says
/// anything: what the others write to stdout and stderr is lost. Throws Error where several were
/// started and this program has no MPI.
std::unique_ptr<Ranks> start_ranks();
/// Which MPI this program was built with, in words; empty: none.
std::string mpi_name();

/// start_ranks() for as long as work() runs. Whatever that throws where there are several ranks
/// ends all of them: see Ranks::fail.
int with_ranks(const std::function<int(Ranks&)>& work);

/// This process alone.
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

/// What a launcher of MPI tells a process of how many there are; 1 where none started it.
int launched_ranks();

// Of values without pointers.
template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}
/// Whose an item of work is where ranks do items by turns: to and fro (0, 1, 1, 0, 0, 1, ...), so
/// that of items which alternate, as two kernels for each seed do, no rank has all of one kind.
inline std::size_t turn_of(std::size_t item, std::size_t ranks) {
    const std::size_t place = item % ranks;
    return item / ranks % 2 == 0 ? place : ranks - 1 - place;
}
/// What all left, in the order of the items, `each` values an item. own: of this rank's items.
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
/// Whether an item is this rank's.
inline bool has_turn(const Ranks& ranks, std::size_t item) {
    return turn_of(item, static_cast<std::size_t>(ranks.count())) ==
           static_cast<std::size_t>(ranks.rank());
}

/// The first rank's, on all. Text and the like.
Bytes from_first(Ranks& ranks, std::span<const std::byte> bytes);
/// The least of all ranks' values.
std::uint32_t least(Ranks& ranks, std::uint32_t value);

}  // namespace darb
