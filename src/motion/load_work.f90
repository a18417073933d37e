!> The work of loads on a beam during a phase, and what a stop dissipates under them, in closed form (docs/theory.md,
!> section 18).
module load_work
   use beam_element, only: gauss_rule
   use contact_losses, only: integral
   use kinds, only: wp
   use phase_drives, only: resonance_at
   use several_state, only: move_alone, several_t
   implicit none (type, external)
   private
   public :: work_of_loads, loss_in_stop

contains

   !> Work from the start of the phase to a time.
   function work_of_loads(self, time) result(work)
      type(several_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: work

      real(wp), dimension(size(self%z)) :: z, v
      integer :: i

      work = 0.0_wp
      if (self%loads%count == 0 .or. .not. time > 0.0_wp) return
      call move_alone(self, time, z, v)
      associate (set => self%set)
         work = work_on_drive(self, time)
         if (size(set%pressed) > 0) then
            work = work + work_on_terms(self, time)
            call add_modes(self, set%joint%inactive, time, z, v, work)
         else
            call add_modes(self, [(i, i=1, size(z))], time, z, v, work)
         end if
      end associate
   end function work_of_loads

   !> Of what swings alone in modes, z'' + 2 a z' + W^2 z = 0: the integral of z is -(z' + 2 a z)/W^2, that of
   !> exp(s t) z' is exp(s t)(s z' + W^2 z)/(s^2 - 2 a s + W^2).
   pure subroutine add_modes(self, modes, time, z, v, work)
      type(several_t), intent(in) :: self
      integer, intent(in) :: modes(:)
      real(wp), intent(in) :: time
      !> State of all modes at that time
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      real(wp), intent(inout) :: work

      complex(wp) :: part, s, power
      real(wp), dimension(size(modes)) :: change, damping
      integer :: g, i

      associate (set => self%set, oscillators => self%set%held%oscillators, drive => self%drive, &
         square => self%set%held%oscillators%square(modes))
         change = z(modes) - self%z(modes)
         damping = oscillators%two_zeta*square + oscillators%mass_rate(modes)
         do g = 1, self%loads%count
            associate (load => set%drive%load(modes, g), piece => drive%piece(g))
               work = work + piece%constant*sum(load*change) + piece%slope*sum(load*(time*z(modes) &
                  + (v(modes) - self%v(modes) + damping*change)/square))
               if (abs(piece%harmonic) <= 0.0_wp) cycle
               s = cmplx(0.0_wp, piece%frequency, wp)
               power = exp(s*time)
               part = (0.0_wp, 0.0_wp)
               do i = 1, size(modes)
                  if (resonates(self, g, modes(i))) then
                     work = work + work_in_resonance(self, modes(i), piece%harmonic*load(i), s, time)
                  else
                     part = part + load(i)*(power*(s*v(modes(i)) + square(i)*z(modes(i))) &
                        - (s*self%v(modes(i)) + square(i)*self%z(modes(i))))/(s**2 - damping(i)*s + square(i))
                  end if
               end do
               work = work + real(piece%harmonic*part, wp)
            end associate
         end do
      end associate
   end subroutine add_modes

   !> Does a load resonate with a mode?
   pure function resonates(self, load, mode) result(does)
      type(several_t), intent(in) :: self
      integer, intent(in) :: load
      integer, intent(in) :: mode
      logical :: does

      associate (pairs => self%set%drive%resonant)
         does = any(pairs%load == load .and. pairs%mode == mode)
      end associate
   end function resonates

   !> Of Re(force exp(s t)) on a mode that swings alone at nearly the same frequency, exponential by exponential.
   pure function work_in_resonance(self, mode, force, s, time) result(work)
      type(several_t), intent(in) :: self
      integer, intent(in) :: mode
      complex(wp), intent(in) :: force
      complex(wp), intent(in) :: s
      real(wp), intent(in) :: time
      real(wp) :: work

      complex(wp) :: amplitude, own
      associate (oscillators => self%set%held%oscillators, z => self%z(mode), v => self%v(mode))
         own = cmplx(-oscillators%decay(mode), oscillators%spread(mode), wp)
         amplitude = own*cmplx(z, -(v + oscillators%decay(mode)*z)/oscillators%spread(mode), wp)
      end associate
      work = 0.5_wp*real(force*(amplitude*over(s + own) + conjg(amplitude)*over(s + conjg(own))), wp)

   contains

      !> Integral of exp(exponent t).
      pure function over(exponent) result(value)
         complex(wp), intent(in) :: exponent
         complex(wp) :: value

         value = integral(exponent, time, exp(exponent*time))
      end function over
   end function work_in_resonance

   !> Of what swings alone in terms.
   pure function work_on_terms(self, time) result(work)
      type(several_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: work

      complex(wp) :: amplitude, power, rate, s
      complex(wp), dimension(self%loads%count) :: load, turn
      integer :: g, m

      work = 0.0_wp
      turn = exp(cmplx(0.0_wp, self%drive%piece%frequency*time, wp))
      associate (set => self%set, joint => self%set%joint, piece => self%drive%piece)
         do m = 1, joint%count
            s = joint%exponent(m)
            power = exp(s*time)
            load = matmul(joint%shape(:, m), set%drive%load)
            amplitude = self%amplitude(m)
            do g = 1, self%loads%count
               rate = amplitude*load(g)
               work = work + real(rate*(piece(g)%constant*(power - 1.0_wp) + piece(g)%slope*(time*power &
                  - integral(s, time, power))), wp)
               if (abs(piece(g)%harmonic) <= 0.0_wp) cycle
               associate (turning => cmplx(0.0_wp, piece(g)%frequency, wp), c => piece(g)%harmonic)
                  work = work + 0.5_wp*real(s*rate*(c*integral(s + turning, time, power*turn(g)) &
                     + conjg(c)*integral(s - turning, time, power*conjg(turn(g)))), wp)
               end associate
            end do
         end do
      end associate
   end function work_on_terms

   !> On what the loads do themselves. Where a mode resonates the power is integrated by a Gauss rule, panel by panel
   !> within which no mode or load turns by more than a quarter: exact to rounding.
   pure function work_on_drive(self, time) result(work)
      type(several_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: work

      integer :: g, m
      complex(wp) :: row

      work = 0.0_wp
      associate (set => self%set%drive, drive => self%drive)
         do g = 1, self%loads%count
            associate (piece => drive%piece(g))
               work = work + drive%slope(set%at%loads + g)*(piece%constant + 0.5_wp*piece%slope*time)*time
               if (abs(piece%harmonic) > 0.0_wp) then
                  associate (s => cmplx(0.0_wp, piece%frequency, wp))
                     work = work + drive%slope(set%at%loads + g)*real(piece%harmonic*integral(s, time, exp(s*time)), wp)
                  end associate
               end if
               do m = 1, size(drive%frequency)
                  row = drive%harmonic(set%at%loads + g, m)
                  if (abs(row) > 0.0_wp) work = work + work_on_harmonic(piece%constant, piece%slope, piece%harmonic, &
                     piece%frequency, row, drive%frequency(m), time)
               end do
            end associate
         end do
      end associate
      if (size(self%drive%pair) > 0) work = work + work_on_resonances(self, time)
   end function work_on_drive

   !> Of a load on a point that moves with Re(row exp(i w t)).
   pure function work_on_harmonic(constant, slope, harmonic, frequency, row, w, time) result(work)
      !> The load
      real(wp), intent(in) :: constant
      real(wp), intent(in) :: slope
      complex(wp), intent(in) :: harmonic
      real(wp), intent(in) :: frequency
      !> The point
      complex(wp), intent(in) :: row
      real(wp), intent(in) :: w
      real(wp), intent(in) :: time
      real(wp) :: work

      complex(wp) :: power, s

      s = cmplx(0.0_wp, w, wp)
      power = exp(s*time)
      work = real(row*(constant*(power - 1.0_wp) + slope*(time*power - integral(s, time, power))), wp)
      if (abs(harmonic) <= 0.0_wp) return
      associate (up => cmplx(0.0_wp, w + frequency, wp), down => cmplx(0.0_wp, w - frequency, wp))
         work = work + 0.5_wp*real(s*row*(harmonic*integral(up, time, exp(up*time)) &
            + conjg(harmonic)*integral(down, time, exp(down*time))), wp)
      end associate
   end function work_on_harmonic

   !> Of all loads on the modes that resonate.
   pure function work_on_resonances(self, time) result(work)
      type(several_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: work

      integer, parameter :: points = 5
      real(wp), allocatable :: point(:), weight(:)
      real(wp) :: fastest, here(0:1), t, width
      integer :: g, i, j, panel, panels

      work = 0.0_wp
      call gauss_rule(points, point, weight)
      associate (set => self%set%drive, drive => self%drive)
         do i = 1, size(drive%pair)
            associate (resonance => drive%resonance(i), mode => set%resonant(drive%pair(i))%mode)
               fastest = max(maxval(drive%frequency), sqrt(resonance%square))
               panels = ceiling(4.0_wp*fastest*time)
               width = time/real(panels, wp)
               do panel = 1, panels
                  do j = 1, points
                     t = width*(real(panel - 1, wp) + point(j))
                     here = resonance_at(resonance, t, 1)
                     do g = 1, self%loads%count
                        associate (piece => drive%piece(g))
                           work = work + width*weight(j)*set%load(mode, g)*here(1)*(piece%constant + piece%slope*t &
                              + real(piece%harmonic*exp(cmplx(0.0_wp, piece%frequency*t, wp)), wp))
                        end associate
                     end do
                  end do
               end do
            end associate
         end do
      end associate
   end function work_on_resonances

   !> Dissipated in the damper of a stop that is pressed: the square of its force or of its rate, a sum of terms like
   !> any other.
   pure function loss_in_stop(self, place, time) result(loss)
      type(several_t), intent(in) :: self
      !> Among those that are pressed
      integer, intent(in) :: place
      real(wp), intent(in) :: time
      real(wp) :: loss

      complex(wp), allocatable :: exponent(:), amplitude(:), power(:)
      real(wp) :: factor, share
      integer :: m, n, row

      associate (set => self%set, joint => self%set%joint, drive => self%drive, spring => self%set%joint%spring(place))
         allocate (exponent, source=[joint%exponent, cmplx(0.0_wp, drive%frequency, wp), (0.0_wp, 0.0_wp)])
         if (spring%branch_stiffness > 0.0_wp) then
            factor = spring%relaxation_rate/spring%branch_stiffness
            row = set%drive%at%branches + set%pressed(place)
            allocate (amplitude, source=[joint%branch(place, :)*self%amplitude, drive%harmonic(row, :), &
               cmplx(drive%constant(row), 0.0_wp, wp)])
         else
            factor = spring%viscosity
            row = set%drive%at%depths + set%pressed(place)
            allocate (amplitude, source=[joint%exponent*joint%indentation(place, :)*self%amplitude, &
               cmplx(0.0_wp, drive%frequency, wp)*drive%harmonic(row, :), cmplx(drive%slope(row), 0.0_wp, wp)])
         end if
      end associate
      allocate (power, source=exp(exponent*time))
      loss = 0.0_wp
      do n = 1, size(exponent)
         ! symmetric in the two terms, up to conjugation
         do m = 1, n
            share = merge(0.5_wp, 1.0_wp, m == n)*factor
            loss = loss + share*real(amplitude(m)*(amplitude(n)*integral(exponent(m) + exponent(n), time, &
               power(m)*power(n)) + conjg(amplitude(n))*integral(exponent(m) + conjg(exponent(n)), time, &
               power(m)*conjg(power(n)))), wp)
         end do
      end do
   end function loss_in_stop

end module load_work
