!> Measures of a run taken from Newmark's own steps, as it takes them.
!>
!> Within a step the displacement of the stop point is the cubic with the displacements and velocities of its ends
!> (Hermite), so that a bounce is seen in full and a velocity that jumps at an impact has its two values; force and
!> energy go on straight lines.
module step_measures
   use bracketed_zero, only: bracket_t, enter, go_to
   use kinds, only: wp
   use response_types, only: event_blow, event_capture, event_impact, event_t, is_contact_end, quiet_level, &
      response_t, run_measures_t
   use run_measures, only: add_rebound, early_part, end_episode, excess_of, finish_tally, mark_energy, take_contact, &
      take_impulse, tally_t
   implicit none (type, external)
   private
   public :: step_measurer_t, piece_t, part_of, greatest_in, measure_motion, measure_contact, measure_energy, &
      measure_event, finish_steps

   !> eta of the stop point in a step
   type :: piece_t
      !> Its beginning and length
      real(wp) :: from = 0.0_wp
      real(wp) :: length = 0.0_wp
      !> eta and d eta/d tau at both ends
      real(wp) :: eta(2) = 0.0_wp
      real(wp) :: rate(2) = 0.0_wp
   end type piece_t

   !> What has gathered so far; numbers only, so that it can be put back where a run goes back.
   type :: step_measurer_t
      type(tally_t) :: tally
      !> A flight that an impact or the end of a contact began is under way, and its highest point so far
      logical :: in_flight = .false.
      real(wp) :: peak_tau = 0.0_wp
      real(wp) :: peak_eta = 0.0_wp
      !> The last step in which |eta_c| exceeds the quiet level
      type(piece_t) :: loud
      !> End of the last step, and eta_c there
      real(wp) :: tau = 0.0_wp
      real(wp) :: eta = 0.0_wp
   end type step_measurer_t

contains

   !> The displacement in a step.
   pure subroutine measure_motion(measurer, piece)
      !> Gets what it tells
      type(step_measurer_t), intent(inout) :: measurer
      type(piece_t), intent(in) :: piece

      !> Greatest value of s (1 - s)^2
      real(wp), parameter :: hump = 4.0_wp/27.0_wp
      real(wp) :: cubic(0:3), turn(2), value, most, may_turn
      integer :: k, turns

      measurer%tau = piece%from + piece%length
      measurer%eta = piece%eta(2)
      if (measurer%in_flight) call raise(measurer, measurer%tau, measurer%eta)
      most = maxval(abs(piece%eta))
      may_turn = most + hump*piece%length*sum(abs(piece%rate))
      turns = 0
      if (may_turn > quiet_level .and. &
         (most <= quiet_level .or. (measurer%in_flight .and. may_turn > measurer%peak_eta))) then
         cubic = cubic_of(piece)
         call find_turns(cubic, turns, turn)
      end if
      do k = 1, turns
         value = cubic_value(cubic, turn(k))
         most = max(most, abs(value))
         if (measurer%in_flight) call raise(measurer, piece%from + turn(k)*piece%length, value)
      end do
      if (most > quiet_level) measurer%loud = piece
   end subroutine measure_motion

   !> A point of a flight.
   pure subroutine raise(measurer, tau, eta)
      !> Gets it if it is the highest so far
      type(step_measurer_t), intent(inout) :: measurer
      !> When and how high
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: eta

      if (eta <= measurer%peak_eta) return
      measurer%peak_tau = tau
      measurer%peak_eta = eta
      if (eta > quiet_level) call end_episode(measurer%tally)
   end subroutine raise

   !> The force in a step of a contact.
   pure subroutine measure_contact(measurer, from, length, force)
      !> Gets what it tells
      type(step_measurer_t), intent(inout) :: measurer
      !> The step
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The force at its ends
      real(wp), intent(in) :: force(2)

      real(wp) :: early, share

      associate (tally => measurer%tally)
         early = early_part(tally, from, length)
         share = 0.5_wp*early/length
         call take_contact(tally, from, length, 0.5_wp*length*sum(force), &
            early*((1.0_wp - share)*force(1) + share*force(2)))
         if (tally%yields) tally%greatest_force = max(tally%greatest_force, tally%force_scale*force(2))
      end associate
   end subroutine measure_contact

   !> The energy in a step: since when is it spent?
   pure subroutine measure_energy(measurer, from, length, energy)
      !> Gets what it tells
      type(step_measurer_t), intent(inout) :: measurer
      !> The step
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> Energy of beam and stop at its ends
      real(wp), intent(in) :: energy(2)

      real(wp) :: excess(2), share

      excess = excess_of(measurer%tally, energy)
      share = 0.0_wp
      if (excess(1) > 0.0_wp .and. excess(2) <= 0.0_wp) share = excess(1)/(excess(1) - excess(2))
      call mark_energy(measurer%tally, excess(2) <= 0.0_wp, from + share*length)
   end subroutine measure_energy

   !> An event. A flight ends with it, or begins.
   pure subroutine measure_event(measurer, event, measures)
      !> Gets what it tells
      type(step_measurer_t), intent(inout) :: measurer
      type(event_t), intent(in) :: event
      !> Gets the rebound that ends
      type(run_measures_t), intent(inout) :: measures

      call end_flight(measurer, measures)
      if (any(event%kind == [event_impact, event_capture, event_blow])) then
         call take_impulse(measurer%tally, event%tau, event%impulse)
      end if
      measurer%in_flight = event%kind == event_impact .or. is_contact_end(event%kind)
      measurer%peak_tau = event%tau
      measurer%peak_eta = event%eta
   end subroutine measure_event

   !> A flight ends.
   pure subroutine end_flight(measurer, measures)
      !> What the steps told
      type(step_measurer_t), intent(in) :: measurer
      !> Gets the rebound
      type(run_measures_t), intent(inout) :: measures

      if (measurer%in_flight .and. measurer%peak_eta > quiet_level) then
         call add_rebound(measures, measurer%peak_tau, measurer%peak_eta)
      end if
   end subroutine end_flight

   !> The end of the run.
   pure subroutine finish_steps(measurer, duration, lost, created, most_peaks, measures, response, surface)
      !> What the steps told
      type(step_measurer_t), intent(inout) :: measurer
      !> Length of the run, tau
      real(wp), intent(in) :: duration
      !> Energy dissipated in the beam, in the stop, at impacts; and created by the nodal reading
      real(wp), intent(in) :: lost(3)
      real(wp), intent(in) :: created
      !> Peaks are kept of so many rebounds
      integer, intent(in) :: most_peaks
      !> Rebounds and the final energy are there
      type(run_measures_t), intent(inout) :: measures
      !> The run, with its events; gets the measures
      type(response_t), intent(inout) :: response
      !> They are those of this surface; default: of the whole run
      integer, intent(in), optional :: surface

      ! it still rises to its highest point
      if (measurer%peak_tau >= measurer%tau) measurer%in_flight = .false.
      call end_flight(measurer, measures)
      call finish_tally(measurer%tally, response, duration, lost, created, most_peaks, measures, surface)
      measures%is_quiet = abs(measurer%eta) <= quiet_level
      measures%quiet_tau = last_loud_time(measurer%loud)
      if (present(surface)) then
         allocate (response%surfaces(surface)%measures, source=measures)
      else
         allocate (response%measures, source=measures)
      end if
   end subroutine finish_steps

   !> A part of a step.
   pure function part_of(piece, begin, end) result(part)
      type(piece_t), intent(in) :: piece
      !> As shares of its length
      real(wp), intent(in) :: begin
      real(wp), intent(in) :: end
      type(piece_t) :: part

      real(wp) :: cubic(0:3), s(2)

      part = piece
      if (begin <= 0.0_wp .and. end >= 1.0_wp) return
      cubic = cubic_of(piece)
      s = [begin, end]
      part%from = piece%from + begin*piece%length
      part%length = (end - begin)*piece%length
      part%eta = [cubic_value(cubic, begin), cubic_value(cubic, end)]
      part%rate = (cubic(1) + s*(2.0_wp*cubic(2) + 3.0_wp*s*cubic(3)))/piece%length
   end function part_of

   !> The greatest value in a step.
   pure function greatest_in(piece) result(greatest)
      type(piece_t), intent(in) :: piece
      real(wp) :: greatest

      real(wp) :: cubic(0:3), turn(2)
      integer :: k, turns

      cubic = cubic_of(piece)
      call find_turns(cubic, turns, turn)
      greatest = maxval(piece%eta)
      do k = 1, turns
         greatest = max(greatest, cubic_value(cubic, turn(k)))
      end do
   end function greatest_in

   !> When |eta_c| last exceeds the quiet level in a step in which it does.
   pure function last_loud_time(piece) result(tau)
      type(piece_t), intent(in) :: piece
      real(wp) :: tau

      real(wp) :: cubic(0:3), mark(0:3), turn(2), point
      integer :: k, turns

      cubic = cubic_of(piece)
      call find_turns(cubic, turns, turn)
      mark(0) = 0.0_wp
      mark(1:turns) = turn(:turns)
      mark(turns + 1) = 1.0_wp
      point = 0.0_wp
      do k = 0, turns
         if (abs(cubic_value(cubic, mark(k))) > quiet_level) point = last_loud_point(cubic, quiet_level, mark(k), &
            mark(k + 1))
      end do
      if (abs(piece%eta(2)) > quiet_level) point = 1.0_wp
      tau = piece%from + point*piece%length
   end function last_loud_time

   !> Coefficients as a polynomial of s = 0 ... 1.
   pure function cubic_of(piece) result(cubic)
      type(piece_t), intent(in) :: piece
      real(wp) :: cubic(0:3)

      real(wp) :: rise, slope(2)

      rise = piece%eta(2) - piece%eta(1)
      slope = piece%length*piece%rate
      cubic = [piece%eta(1), slope(1), 3.0_wp*rise - 2.0_wp*slope(1) - slope(2), slope(1) + slope(2) - 2.0_wp*rise]
   end function cubic_of

   !> Where |cubic| falls through the level between a point above it and one that is not, with no
   !> turn in between: bisection down to neighbouring numbers.
   pure function last_loud_point(cubic, level, loud, quiet) result(point)
      !> Coefficients
      real(wp), intent(in) :: cubic(0:3)
      real(wp), intent(in) :: level
      !> The two points
      real(wp), intent(in) :: loud
      real(wp), intent(in) :: quiet
      real(wp) :: point

      type(bracket_t) :: bracket

      bracket = bracket_t(low=loud, high=quiet, point=loud, least_value=-1.0_wp)
      call go_to(bracket)
      do while (.not. bracket%is_found)
         call enter(bracket, abs(cubic_value(cubic, bracket%point)) - level)
         call go_to(bracket)
      end do
      point = bracket%low
   end function last_loud_point

   !> The value of a polynomial.
   pure function cubic_value(cubic, s) result(value)
      !> Coefficients, ascending
      real(wp), intent(in) :: cubic(0:3)
      !> Argument
      real(wp), intent(in) :: s
      real(wp) :: value

      value = cubic(0) + s*(cubic(1) + s*(cubic(2) + s*cubic(3)))
   end function cubic_value

   !> Where a cubic turns inside 0 < s < 1: the roots of c1 + 2 c2 s + 3 c3 s^2, without cancellation.
   pure subroutine find_turns(cubic, turns, turn)
      !> Coefficients, ascending
      real(wp), intent(in) :: cubic(0:3)
      !> Number of turns, 0 to 2
      integer, intent(out) :: turns
      !> The turns, ascending
      real(wp), intent(out) :: turn(2)

      integer :: k
      real(wp) :: discriminant, root(2), sum

      turns = 0
      turn = 0.0_wp
      discriminant = cubic(2)**2 - 3.0_wp*cubic(1)*cubic(3)
      if (discriminant <= 0.0_wp) return
      sum = -(cubic(2) + sign(sqrt(discriminant), cubic(2)))
      ! Quotients outside 0 ... 1 are never formed: they may overflow.
      root = -1.0_wp
      if (is_fraction(sum, 3.0_wp*cubic(3))) root(1) = sum/(3.0_wp*cubic(3))
      if (is_fraction(cubic(1), sum)) root(2) = cubic(1)/sum
      if (root(1) > root(2)) root = root([2, 1])
      do k = 1, 2
         if (root(k) <= 0.0_wp .or. root(k) >= 1.0_wp) cycle
         turns = turns + 1
         turn(turns) = root(k)
      end do
   end subroutine find_turns

   !> Is 0 < numerator/denominator < 1?
   elemental function is_fraction(numerator, denominator) result(answer)
      !> The quotient
      real(wp), intent(in) :: numerator
      real(wp), intent(in) :: denominator
      logical :: answer

      answer = abs(numerator) < abs(denominator) .and. (numerator > 0.0_wp .eqv. denominator > 0.0_wp)
   end function is_fraction

end module step_measures
