!> Numeric kinds, and constants that all parts of the program use.
module kinds
   use, intrinsic :: iso_fortran_env, only: int64, real64
   implicit none (type, external)
   private
   public :: wp, i8, pi, lambda1, lambda1_power4

   !> Working precision: IEEE double.
   integer, parameter :: wp = real64
   !> Long integers, for counters and clocks.
   integer, parameter :: i8 = int64

   real(wp), parameter :: pi = 3.141592653589793_wp
   !> First root of 1 + cos k cosh k = 0: first wave number, times L, of a uniform cantilever without tip mass.
   real(wp), parameter :: lambda1 = 1.875104068711961_wp
   !> lambda1^4: squared circular frequency omega1^2 of that cantilever if E Ibar = rho Abar = L = 1.
   real(wp), parameter :: lambda1_power4 = lambda1**4

end module kinds
