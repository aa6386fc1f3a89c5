"""What is timed, one module a tool, each with ``prepare(options) -> (solve, read)``: ``solve()`` is what the clock runs
over, ``read(answer)`` takes the numbers out of it afterwards. Only `validate.bench.measure` imports them, so that they
import at their top what they need, as their users would."""
