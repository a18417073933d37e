!> A stretch of a motion without events as observers see it: a phase of exact motion, or a step of Newmark's method.
!>
!> What moves is a row: the gap of a contact, s (y - d) with s = 1 for a stop below the beam and -1 above it, the
!> displacement of the tip, the force of a closed contact, the bending moment at a place. Observers ask an interval for
!> values, integrals and extremes of rows, and do not know the method.
module motion_intervals
   use kinds, only: wp
   use signal_peaks, only: extreme_search_t
   implicit none (type, external)
   private
   public :: interval_t, observed_contact_t, row_t, peak_t, curve_t

   !> How a contact stands with the beam during an interval.
   type :: observed_contact_t
      !> Its number in the scene's order of surfaces, s and s d
      integer :: number = 1
      real(wp) :: sign = 1.0_wp
      real(wp) :: height = 0.0_wp
      !> It acts on the beam
      logical :: is_closed = .false.
      !> Its stop yields, and its force has a limit in the mesh; its force is finite, as that of a massless node is
      logical :: yields = .false.
      logical :: has_force = .false.
      !> It can be met at all
      logical :: is_active = .true.
      !> It is closed, and its gap is exactly zero
      logical :: holds = .false.
      !> How often the beam has left it since the start of the run
      integer :: flights = 0
   end type observed_contact_t

   !> offset + factor times a row.
   type :: row_t
      integer :: number = 1
      real(wp) :: factor = 1.0_wp
      real(wp) :: offset = 0.0_wp
      !> Where its peaks are near zero their tolerance is a share of this; negative: of the peaks all the same
      real(wp) :: scale = -1.0_wp
   end type row_t

   !> A greatest value.
   type :: peak_t
      !> It exceeds what was known
      logical :: is_found = .false.
      !> It is that at the end of the stretch
      logical :: still_rises = .false.
      real(wp) :: value = 0.0_wp
      !> Since the start of the interval
      real(wp) :: time = 0.0_wp
      !> What searches for this extreme have left
      type(extreme_search_t) :: looks
   end type peak_t

   !> A row through an interval, kept after it.
   type, abstract :: curve_t
      !> Start of the interval, tau, and its length
      real(wp) :: start = 0.0_wp
      real(wp) :: length = 0.0_wp
   contains
      procedure(last_beyond_interface), deferred :: last_beyond
   end type curve_t

   type, abstract :: interval_t
      !> Its start, tau, and its length
      real(wp) :: start = 0.0_wp
      real(wp) :: length = 0.0_wp
      !> Number of contacts, of places where moments are asked for
      integer :: contacts = 0
      integer :: places = 0
      !> The run ends with it
      logical :: is_last = .false.
      !> Beam and stops may hold more energy after it than before
      logical :: may_gain = .false.
      !> Peaks are looked for from a share above those known on: searching takes time
      real(wp) :: tolerance = 0.0_wp
   contains
      procedure(contact_interface), deferred :: contact
      procedure(evaluate_interface), deferred :: evaluate
      procedure(reach_interface), deferred :: reach
      procedure(reach_interface), deferred :: rounding
      procedure(exceeds_interface), deferred :: exceeds
      procedure(seek_peak_interface), deferred :: seek_peak
      procedure(keep_gap_interface), deferred :: keep_gap
      procedure(impulse_interface), deferred :: impulse
      procedure(integrate_interface), deferred :: integrate
      procedure(energy_interface), deferred :: energy
      procedure :: tip_row
      procedure :: force_row
      procedure :: moment_row
   end type interval_t

   abstract interface
      !> When was the magnitude last above a level?
      subroutine last_beyond_interface(self, level, time, is_at_end)
         import :: curve_t, wp
         implicit none (type, external)
         class(curve_t), intent(in) :: self
         real(wp), intent(in) :: level
         !> Since the start of the interval, 0: never
         real(wp), intent(out) :: time
         !> It still is at the end
         logical, intent(out) :: is_at_end
      end subroutine last_beyond_interface

      pure function contact_interface(self, k) result(contact)
         import :: interval_t, observed_contact_t
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
         type(observed_contact_t) :: contact
      end function contact_interface

      !> A row and its rate at a time since the start.
      function evaluate_interface(self, row, time) result(state)
         import :: interval_t, row_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         type(row_t), intent(in) :: row
         real(wp), intent(in) :: time
         real(wp) :: state(2)
      end function evaluate_interface

      !> `reach`: what the magnitude of a contact's gap does not exceed, as far as is known without a search;
      !> `rounding`: the rounding error of the gap.
      pure function reach_interface(self, k) result(reach)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
         real(wp) :: reach
      end function reach_interface

      !> Does a row exceed a level?
      function exceeds_interface(self, row, level) result(does)
         import :: interval_t, row_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         type(row_t), intent(in) :: row
         real(wp), intent(in) :: level
         logical :: does
      end function exceeds_interface

      !> The greatest value of a row on a stretch of the interval, if it is greater than what is known.
      subroutine seek_peak_interface(self, row, stretch, known, peak)
         import :: interval_t, peak_t, row_t, wp
         implicit none (type, external)
         class(interval_t), intent(inout) :: self
         type(row_t), intent(in) :: row
         !> Its ends, since the start of the interval
         real(wp), intent(in) :: stretch(2)
         real(wp), intent(in) :: known
         type(peak_t), intent(inout) :: peak
      end subroutine seek_peak_interface

      !> Keep the gap of a contact.
      subroutine keep_gap_interface(self, k, curve)
         import :: curve_t, interval_t
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
         class(curve_t), allocatable, intent(inout) :: curve
      end subroutine keep_gap_interface

      !> Integral of the force of a closed contact up to a time since the start.
      function impulse_interface(self, k, time) result(impulse)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
         real(wp), intent(in) :: time
         real(wp) :: impulse
      end function impulse_interface

      !> Integrals of all rows but moments, and of their squares, over a stretch of the interval.
      subroutine integrate_interface(self, stretch, first, second)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(inout) :: self
         !> Its ends, since the start of the interval
         real(wp), intent(in) :: stretch(2)
         !> Of displacements, which are gaps + s d, and forces, and of their squares, [2 contacts + 1]
         real(wp), intent(out) :: first(:)
         real(wp), intent(out) :: second(:)
      end subroutine integrate_interface

      !> Energy of beam and stops at a time since the start.
      function energy_interface(self, time) result(energy)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         real(wp), intent(in) :: time
         real(wp) :: energy
      end function energy_interface
   end interface

contains

   !> Displacement of the tip, up from the unstressed beam. The rows before it are the gaps.
   pure integer function tip_row(self)
      class(interval_t), intent(in) :: self

      tip_row = self%contacts + 1
   end function tip_row

   !> Force of a closed contact.
   pure integer function force_row(self, k)
      class(interval_t), intent(in) :: self
      integer, intent(in) :: k

      force_row = self%contacts + 1 + k
   end function force_row

   !> Moment at a place.
   pure integer function moment_row(self, p)
      class(interval_t), intent(in) :: self
      integer, intent(in) :: p

      moment_row = 2*self%contacts + 1 + p
   end function moment_row

end module motion_intervals
