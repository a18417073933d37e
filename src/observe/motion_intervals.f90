!> Interval of a motion without events as observers read it: a phase of exact motion, or a step of Newmark's method.
!>
!> The observed quantities are linear functionals of the state, called rows, and have numbers: the gaps of all contacts,
!> s (y - d) with s = 1 for a contact below the beam and -1 for a contact above it, the displacement of the tip, the
!> forces of the closed contacts, the bending moments at given places, and the displacements of the bodies. An observer
!> (of measures, statistics, moments, Poincare sections) requests values, integrals and extremes of rows, and does not
!> depend on the method.
module motion_intervals
   use exponential_sums, only: exponential_sums_t
   use kinds, only: i8, wp
   use signal_peaks, only: extreme_search_t
   implicit none (type, external)
   private
   public :: interval_t, observed_contact_t, output_row_t, peak_t, curve_t

   !> Status of a contact during an interval.
   type :: observed_contact_t
      !> Number in the scene's order of contacts
      integer :: number = 1
      !> Sign s of the contact: 1 below the beam, -1 above it
      real(wp) :: sign = 1.0_wp
      !> Height s d of the contact surface with the coordinate d; gap + s d is s times the displacement of the beam
      real(wp) :: signed_height = 0.0_wp
      !> Whether the contact is closed
      logical :: is_closed = .false.
      !> Whether the contact is compliant, so that its force converges with the mesh
      logical :: is_compliant = .false.
      !> Whether the force of the contact has a finite maximum: the contact is compliant, or rigid with a massless node
      !> of the beam in front of it
      logical :: has_finite_force = .false.
      !> Whether the contact is active: no other contact is in front of this contact and, with exact motion, the beam
      !> can reach this contact
      logical :: is_active = .true.
      !> Whether the contact is closed and its gap is exactly zero
      logical :: has_zero_gap = .false.
      !> Number of flights since the start of the run
      integer :: flights = 0
      !> Index of the first contact at the same place of the beam, at which the displacement is the same; `huge`:
      !> unknown
      integer :: first_at_place = huge(1)
      !> Whether the displacement at the contact is that of the tip
      logical :: is_at_tip = .false.
   end type observed_contact_t

   !> The quantity offset + factor times a row.
   type :: output_row_t
      !> Number of the row
      integer :: number = 1
      !> Factor of the row
      real(wp) :: factor = 1.0_wp
      !> Constant that is added
      real(wp) :: offset = 0.0_wp
      !> Minimum magnitude to which the relative tolerance of a peak refers; negative: it refers to the peak itself
      real(wp) :: scale = -1.0_wp
      !> Whether the instant of a peak is needed, not only its value
      logical :: needs_time = .false.
      !> 0: the row itself; 2: its second derivative by time (an acceleration), of gaps and tip only, for `evaluate`,
      !> `range_of` and `seek_peak`
      integer :: order = 0
   end type output_row_t

   !> Maximum of a row on a span of an interval.
   type :: peak_t
      !> Whether the maximum exceeds the given threshold
      logical :: is_found = .false.
      !> Whether the maximum is at the end of the span, where the row still rises
      logical :: still_rises = .false.
      !> The maximum
      real(wp) :: value = 0.0_wp
      !> Time of the maximum since the start of the interval
      real(wp) :: time = 0.0_wp
   end type peak_t

   !> A row over an interval, stored for a later search.
   type, abstract :: curve_t
      !> Start of the interval, tau
      real(wp) :: start = 0.0_wp
      !> Length of the interval, tau
      real(wp) :: length = 0.0_wp
   contains
      procedure(last_exceedance_interface), deferred :: last_exceedance
   end type curve_t

   !> A phase or a step.
   type, abstract :: interval_t
      !> Start of the interval, tau
      real(wp) :: start = 0.0_wp
      !> Length of the interval, tau
      real(wp) :: length = 0.0_wp
      !> Number of contacts
      integer :: contacts = 0
      !> Number of places at which moments are requested
      integer :: places = 0
      !> Number of displacements that are not of the beam
      integer :: others = 0
      !> Whether the run ends with the interval
      logical :: is_last = .false.
      !> Whether the energy of beam and stops may grow during the interval
      logical :: may_gain = .false.
      !> A maximum is searched only if it may exceed the known maximum by more than this fraction of it, because a
      !> search takes time
      real(wp) :: tolerance = 0.0_wp
   contains
      procedure(contact_interface), deferred :: contact
      procedure(evaluate_interface), deferred :: evaluate
      procedure(gap_magnitude_interface), deferred :: gap_bound
      procedure(gap_magnitude_interface), deferred :: rounding
      procedure(exceeds_interface), deferred :: exceeds
      procedure(range_interface), deferred :: range_of
      procedure(seek_peak_interface), deferred :: seek_peak
      procedure(seek_turn_interface), deferred :: seek_turn
      procedure(record_gap_interface), deferred :: record_gap
      procedure(impulse_interface), deferred :: impulse
      procedure(integrate_interface), deferred :: integrate
      procedure(expand_interface), deferred :: expand_in_exponentials
      procedure(energy_interface), deferred :: energy
      procedure(dissipated_interface), deferred :: dissipated
      procedure :: tip_row
      procedure :: force_row
      procedure :: moment_row
      procedure :: displacement_row
   end type interval_t

   abstract interface
      !> Find the last time at which the magnitude of the row exceeds a level.
      subroutine last_exceedance_interface(self, level, time, is_at_end)
         import :: curve_t, wp
         implicit none (type, external)
         class(curve_t), intent(in) :: self
         real(wp), intent(in) :: level
         !> Time since the start of the interval; 0: the row never exceeds the level
         real(wp), intent(out) :: time
         !> Whether the magnitude exceeds the level at the end of the interval
         logical, intent(out) :: is_at_end
      end subroutine last_exceedance_interface

      !> Status of contact k.
      pure type(observed_contact_t) function contact_interface(self, k) result(contact)
         import :: interval_t, observed_contact_t
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
      end function contact_interface

      !> Value and rate of a row at a time since the start of the interval.
      function evaluate_interface(self, row, time) result(state)
         import :: interval_t, output_row_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         type(output_row_t), intent(in) :: row
         real(wp), intent(in) :: time
         real(wp) :: state(2)
      end function evaluate_interface

      !> `gap_bound`: upper bound of the magnitude of the gap of contact k, known without a search; `rounding`: rounding
      !> error of this gap.
      pure real(wp) function gap_magnitude_interface(self, k) result(magnitude)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
      end function gap_magnitude_interface

      !> Whether a row exceeds a level.
      logical function exceeds_interface(self, row, level) result(does)
         import :: interval_t, output_row_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         type(output_row_t), intent(in) :: row
         real(wp), intent(in) :: level
      end function exceeds_interface

      !> Lower and upper bound of a row over the interval, known without a search; infinite bounds are `huge`.
      function range_interface(self, row) result(bounds)
         import :: interval_t, output_row_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         type(output_row_t), intent(in) :: row
         real(wp) :: bounds(2)
      end function range_interface

      !> Find the maximum of a row on a span of the interval, if it exceeds a known value.
      subroutine seek_peak_interface(self, row, span, known, peak, search_state)
         import :: extreme_search_t, interval_t, peak_t, output_row_t, wp
         implicit none (type, external)
         class(interval_t), intent(inout) :: self
         type(output_row_t), intent(in) :: row
         !> Beginning and end of the span, since the start of the interval
         real(wp), intent(in) :: span(2)
         real(wp), intent(in) :: known
         type(peak_t), intent(inout) :: peak
         !> Tolerance of the searches for this extreme, and number of evaluations that remain for them
         type(extreme_search_t), intent(inout) :: search_state
      end subroutine seek_peak_interface

      !> Find the first turning point (zero of the rate) of a row inside a span of the interval.
      subroutine seek_turn_interface(self, row, span, direction, is_found, time, evaluations)
         import :: interval_t, output_row_t, i8, wp
         implicit none (type, external)
         class(interval_t), intent(inout) :: self
         type(output_row_t), intent(in) :: row
         !> Beginning and end of the span, since the start of the interval
         real(wp), intent(in) :: span(2)
         !> On entry 1 (-1) if the span begins at a turning point after which the row rises (falls), else 0; on return 1
         !> (-1) if the row rises (falls) after the turning point that was found
         integer, intent(inout) :: direction
         logical, intent(out) :: is_found
         !> Time since the start of the interval
         real(wp), intent(out) :: time
         !> Number of evaluations of the motion, to which those of this search are added
         integer(i8), intent(inout) :: evaluations
      end subroutine seek_turn_interface

      !> Store the gap of contact k over the interval.
      subroutine record_gap_interface(self, k, curve)
         import :: curve_t, interval_t
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
         class(curve_t), allocatable, intent(inout) :: curve
      end subroutine record_gap_interface

      !> Integral of the force of a closed contact from the start of the interval to a given time.
      real(wp) function impulse_interface(self, k, time) result(impulse)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
         real(wp), intent(in) :: time
      end function impulse_interface

      !> Integrals of rows and of their squares over a span of the interval. The row of a gap is integrated as s times
      !> the displacement, gap + s d, whereas `evaluate` and the searches for extremes refer to the gap.
      subroutine integrate_interface(self, span, integrals, square_integrals, order)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(inout) :: self
         !> Beginning and end of the span, since the start of the interval
         real(wp), intent(in) :: span(2)
         !> Integrals of gap + s d at contacts, of the displacement of the tip, and of forces, [2 contacts + 1]
         real(wp), intent(out) :: integrals(:)
         !> Integrals of the squares of these quantities, [2 contacts + 1]
         real(wp), intent(out) :: square_integrals(:)
         !> 2: the quantities are accelerations at contacts and tip, [contacts + 1]; default: 0
         integer, intent(in), optional :: order
      end subroutine integrate_interface

      !> Expand rows into cubic polynomials and exponentials over the whole interval, which is longer than zero. The row
      !> of a gap is expanded as gap + s d, s times the displacement. The force of an open contact is zero.
      subroutine expand_interface(self, rows, sums)
         import :: exponential_sums_t, interval_t
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: rows(:)
         !> One signal for each row
         type(exponential_sums_t), intent(out) :: sums
      end subroutine expand_interface

      !> Energy of beam and stops at a time since the start of the interval.
      real(wp) function energy_interface(self, time) result(energy)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         real(wp), intent(in) :: time
      end function energy_interface

      !> Energy dissipated in the dampers of the stop of contact k from the start of the interval to a given time,
      !> without losses at impacts.
      real(wp) function dissipated_interface(self, k, time) result(energy)
         import :: interval_t, wp
         implicit none (type, external)
         class(interval_t), intent(in) :: self
         integer, intent(in) :: k
         !> Time since the start of the interval
         real(wp), intent(in) :: time
      end function dissipated_interface
   end interface

contains

   !> Row of the displacement of the tip, upwards from the unstressed beam. The rows before it are the gaps.
   pure integer function tip_row(self)
      class(interval_t), intent(in) :: self

      tip_row = self%contacts + 1
   end function tip_row

   !> Row of the force of a closed contact.
   pure integer function force_row(self, k)
      class(interval_t), intent(in) :: self
      integer, intent(in) :: k

      force_row = self%contacts + 1 + k
   end function force_row

   !> Row of the moment at a place.
   pure integer function moment_row(self, p)
      class(interval_t), intent(in) :: self
      integer, intent(in) :: p

      moment_row = 2*self%contacts + 1 + p
   end function moment_row

   !> Row of the displacement of the tip or, of which observers request only values and expansions, of a body.
   pure integer function displacement_row(self, d)
      class(interval_t), intent(in) :: self
      !> Number of the body; 0: the tip
      integer, intent(in) :: d

      displacement_row = merge(self%moment_row(self%places) + d, self%tip_row(), d > 0)
   end function displacement_row

end module motion_intervals
