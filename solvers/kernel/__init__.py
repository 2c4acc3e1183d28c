"""Tracking paths: elimination order, compiled tick, predictor, corrector and step control.

=================== =================================================================================
``engine``          one system made ready; chooses how to run the tick; ``make_engine`` is the way in
``reference``       the method in plain sight: predictor, corrector, step control, in NumPy
``elimination``     the order of a sparse LU, and a whole tick as one straight-line program
``tracker``         the same method with paths in SIMD lanes: queue, lanes, parameters on their way
``stepping``        … and what each lane makes of a tick
``lanes``           a vector register as a type of numba's
``codegen``         a tick as machine code, through LLVM
``interpreter``     a tick interpreted; elimination with pivoting in each lane
``double_lanes``    a tick in double-double
``multiprecision``  a tick in Arb numbers
``compiled``        what loads numba, and when; ``kernel_is_cached`` tells whether that is quick
``layout``          where everything lies in the workspace of a thread
``sources``         what caches of compiled code depend on
=================== =================================================================================
"""
