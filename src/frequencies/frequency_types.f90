!> A table of frequencies, with a column for each solver and mesh and a row for each mode.
module frequency_types
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use kinds, only: wp
   use mode_shapes, only: mode_quality_t
   implicit none (type, external)
   private
   public :: frequency_table_t, frequency_column_t, error_in_percent

   type :: frequency_column_t
      !> Name of the solver as users write it
      character(:), allocatable :: solver
      !> Number of elements of the mesh
      integer :: elements = 0
      !> Ratio of neighbouring element lengths, l_i/l_(i+1); 0: the nodes are given
      real(wp) :: ratio = 1.0_wp
      !> lambda_i, [modes found]
      real(wp), allocatable :: lambda(:)
      !> Reason why the solver failed; unallocated: the solver succeeded
      character(:), allocatable :: failure
   end type frequency_column_t

   type :: frequency_table_t
      !> Computed columns
      type(frequency_column_t), allocatable :: columns(:)
      !> Exact lambda_i, [rows]; unallocated: not requested
      real(wp), allocatable :: exact(:)
      !> Positions x/L of the nodes in the mesh of the first column, [0:n]; unallocated: shapes are not requested
      real(wp), allocatable :: node(:)
      !> Displacements of the mode shapes at the nodes, with unit modal mass and positive displacement of the tip, [0:n,
      !> modes]; unallocated: not requested
      real(wp), allocatable :: shape(:, :)
      !> Slopes of the mode shapes at the nodes, [0:n, modes]
      real(wp), allocatable :: shape_slope(:, :)
      !> Orthogonality errors of the mode shapes; that for K cannot be below the cancellation within the assembled K
      type(mode_quality_t) :: quality
   end type frequency_table_t

contains

   !> Error of lambda in percent; NaN for a rigid-body mode.
   elemental real(wp) function error_in_percent(lambda, exact) result(error)
      real(wp), intent(in) :: lambda
      real(wp), intent(in) :: exact

      error = ieee_value(1.0_wp, ieee_quiet_nan)
      if (exact > 0.0_wp) error = 100.0_wp*(lambda/exact - 1.0_wp)
   end function error_in_percent

end module frequency_types
